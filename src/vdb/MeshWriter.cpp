#include "curlew/base/AtomicFile.h"
#include "curlew/base/Error.h"
#include "curlew/vdb/MeshFile.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <ostream>

namespace curlew {

namespace {

/// Calls visit(corners, count) for every face.
template <class Visit>
void visitFaces(const Mesh& mesh, const Visit& visit) {
    for (const auto& face : mesh.triangles) visit(face.asV(), 3);
    for (const auto& face : mesh.quads) visit(face.asV(), 4);
}

void checkMesh(const Mesh& mesh) {
    for (const auto& p : mesh.points)
        if (!p.isFinite()) throw ValueError("the mesh has a position that is not finite");
    visitFaces(mesh, [&](const openvdb::Index32* corners, int count) {
        if (std::any_of(corners, corners + count, [&](openvdb::Index32 c) { return c >= mesh.points.size(); }))
            throw ValueError("the mesh has a face with a corner that does not exist");
    });
    if (mesh.points.size() > INT32_MAX)
        throw ValueError(fmt::format("a mesh of {} points is too large for a file", mesh.points.size()));
}

void append(std::string& bytes, const void* data, size_t size) {
    static_assert(std::endian::native == std::endian::little, "the header below says so");
    bytes.append(static_cast<const char*>(data), size);
}

/// Collects output and hands it on in pieces.
class Output {
  public:
    explicit Output(std::ostream& out) : mOut(out) {}
    ~Output() = default;
    Output(const Output&) = delete;
    Output& operator=(const Output&) = delete;

    std::string& bytes() {
        constexpr size_t kPiece = size_t{1} << 16;
        if (mBytes.size() > kPiece) flush();
        return mBytes;
    }
    void flush() {
        mOut.write(mBytes.data(), static_cast<std::streamsize>(mBytes.size()));
        mBytes.clear();
    }

  private:
    std::ostream& mOut;
    std::string mBytes;
};

void writePlyMesh(std::ostream& out, const Mesh& mesh) {
    out << fmt::format(
        "ply\nformat binary_little_endian 1.0\ncomment Curlew\nelement vertex {}\nproperty float x\nproperty float y\n"
        "property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.points.size(), mesh.faces());
    Output output(out);
    for (const auto& p : mesh.points) append(output.bytes(), p.asV(), 3 * sizeof(float));
    visitFaces(mesh, [&](const openvdb::Index32* corners, int count) {
        std::string& bytes = output.bytes();
        bytes.push_back(static_cast<char>(count));
        append(bytes, corners, static_cast<size_t>(count) * sizeof(*corners));
    });
    output.flush();
}

void writeObj(std::ostream& out, const Mesh& mesh) {
    Output output(out);
    output.bytes() += "# Curlew\n";
    for (const auto& p : mesh.points)
        fmt::format_to(std::back_inserter(output.bytes()), "v {} {} {}\n", p[0], p[1], p[2]);
    visitFaces(mesh, [&](const openvdb::Index32* corners, int count) {
        std::string& text = output.bytes();
        text += 'f';
        for (int k = 0; k < count; ++k) fmt::format_to(std::back_inserter(text), " {}", uint64_t{corners[k]} + 1);
        text += '\n';
    });
    output.flush();
}

} // namespace

void writeMesh(const std::filesystem::path& path, const Mesh& mesh, const std::function<bool()>& cancelled) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (extension != ".ply" && extension != ".obj")
        throw ValueError(
            fmt::format("a mesh cannot be written to '{}'; its name must end in .ply or .obj", path.string()));
    checkMesh(mesh);
    writeAtomically(
        path, [&](std::ostream& out) { extension == ".ply" ? writePlyMesh(out, mesh) : writeObj(out, mesh); },
        cancelled);
}

} // namespace curlew
