// SPDX-License-Identifier: Apache-2.0
#include "GltfFloats.h"

#include "curlew/base/Memory.h"

#include <assimp/DefaultIOSystem.h>
#include <assimp/MemoryIOWrapper.h>
#include <boost/archive/iterators/binary_from_base64.hpp>
#include <boost/archive/iterators/dataflow_exception.hpp>
#include <boost/archive/iterators/transform_width.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <optional>
#include <set>
#include <unordered_map>

namespace curlew {

namespace {

using nlohmann::json;

constexpr std::string_view kFloatsName = "curlew-floats"; // URI of the added buffer, which is not a file
constexpr int kDeepest = 200;                             // levels of JSON; Assimp's parser is recursive
constexpr size_t kHeaderSize = 12, kChunkHeaderSize = 8;  // of a .glb (glTF 2.0, 4.4)

/// A copy of a glTF file that refers to `floats` as a buffer named kFloatsName.
struct GltfCopy {
    std::string file;
    std::string floats;
};

/// Returns a member that is a list or an object; an empty list if there is none.
const json& listOf(const json& parent, const char* name) {
    static const json none = json::array();
    if (!parent.is_object() || !parent.contains(name)) return none;
    const json& list = parent.at(name);
    return list.is_structured() ? list : none;
}

template <class T>
void append(std::string& bytes, const T& value) {
    std::array<char, sizeof(T)> raw{};
    std::memcpy(raw.data(), &value, sizeof(T));
    bytes.append(raw.data(), raw.size());
}

/// Returns the number that an integer of type T stands for (glTF 2.0, 3.11).
template <class T>
double numberOf(const char* bytes, bool normalized) {
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    const auto number = static_cast<double>(value);
    return normalized ? std::max(number / std::numeric_limits<T>::max(), -1.0) : number;
}

/// An integer type of a glTF accessor.
struct IntegerType {
    int code; ///< Its componentType.
    size_t size;
    double (*convert)(const char* bytes, bool normalized);
};
constexpr std::array<IntegerType, 5> kIntegerTypes{{{5120, 1, numberOf<int8_t>},
                                                    {5121, 1, numberOf<uint8_t>},
                                                    {5122, 2, numberOf<int16_t>},
                                                    {5123, 2, numberOf<uint16_t>},
                                                    {5125, 4, numberOf<uint32_t>}}};
constexpr int kFloatType = 5126;

/// Returns the integer type with this code, or null.
const IntegerType* integerType(const json& code) {
    const auto found = std::find_if(kIntegerTypes.begin(), kIntegerTypes.end(),
                                    [&](const IntegerType& type) { return code == type.code; });
    return found == kIntegerTypes.end() ? nullptr : &*found;
}

class FloatCopier {
  public:
    FloatCopier(const std::filesystem::path& path, const MeshSource& source, json root)
        : mPath(path), mSource(source), mRoot(std::move(root)) {}

    /// Returns the copy, or nothing if the file needs none.
    std::optional<GltfCopy> copy() {
        findAccessors();
        if (mWanted.empty() && mDecoded.empty()) return {};
        for (const size_t k : mWanted) replace(mRoot.at("accessors").at(k));
        for (const size_t k : mDecoded) {
            json& accessor = mRoot.at("accessors").at(k);
            accessor["componentType"] = kFloatType;
            for (const char* name : {"bufferView", "byteOffset", "normalized", "min", "max"}) accessor.erase(name);
        }
        mRoot["buffers"].push_back({{"byteLength", mFloats.size()}, {"uri", kFloatsName}});
        return GltfCopy{fileOf(mRoot.dump()), std::move(mFloats)};
    }

  private:
    void findAccessors() {
        for (const json& mesh : listOf(mRoot, "meshes"))
            for (const json& primitive : listOf(mesh, "primitives")) {
                const json& draco = listOf(listOf(primitive, "extensions"), "KHR_draco_mesh_compression");
                for (const auto& [name, accessor] : listOf(primitive, "attributes").items())
                    if (name == "POSITION" || name.starts_with("WEIGHTS_"))
                        want(accessor, listOf(draco, "attributes").contains(name) ? mDecoded : mWanted);
                for (const json& target : listOf(primitive, "targets"))
                    if (target.contains("POSITION")) want(target.at("POSITION"), mWanted);
            }
        for (const json& animation : listOf(mRoot, "animations"))
            for (const json& sampler : listOf(animation, "samplers"))
                if (sampler.contains("output")) want(sampler.at("output"), mWanted);
    }

    /// Adds an accessor to a set if it has integers. Assimp reports one that does not exist.
    void want(const json& number, std::set<size_t>& set) {
        const json& accessors = listOf(mRoot, "accessors");
        if (!number.is_number_unsigned() || number.get<size_t>() >= accessors.size()) return;
        const json& accessor = accessors.at(number.get<size_t>());
        if (accessor.is_object() && integerType(accessor.value("componentType", json())))
            set.insert(number.get<size_t>());
    }

    /// Makes an accessor refer to floats, which it appends to the added buffer.
    void replace(json& accessor) {
        const std::vector<float> numbers = numbersOf(accessor);
        const size_t size = numbers.size() * sizeof(float);
        json view{{"buffer", listOf(mRoot, "buffers").size()}, {"byteOffset", mFloats.size()}, {"byteLength", size}};
        mFloats.append(reinterpret_cast<const char*>(numbers.data()), size);
        accessor = {{"componentType", kFloatType},
                    {"count", accessor.at("count")},
                    {"type", accessor.at("type")},
                    {"bufferView", listOf(mRoot, "bufferViews").size()}};
        mRoot["bufferViews"].push_back(std::move(view));
    }

    std::vector<float> numbersOf(const json& accessor) {
        static const std::unordered_map<std::string, size_t> components{
            {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}};
        const auto count = accessor.at("count").get<size_t>();
        const size_t parts = components.at(accessor.at("type").get<std::string>());
        const IntegerType& type = *integerType(accessor.at("componentType"));
        const bool normalized = accessor.value("normalized", false);
        requireMemory(static_cast<double>(parts * sizeof(float)) * static_cast<double>(count),
                      fmt::format("'{}'", mPath.string()), "use a simpler model");
        std::vector<float> numbers(count * parts);
        const auto convert = [&](const char* bytes, size_t element) {
            for (size_t k = 0; k < parts; ++k)
                numbers[element * parts + k] = static_cast<float>(type.convert(bytes + k * type.size, normalized));
        };
        if (accessor.contains("bufferView")) {
            const Elements elements(*this, accessor, count, parts * type.size);
            for (size_t n = 0; n < count; ++n) convert(elements[n], n);
        }
        if (accessor.contains("sparse")) {
            const json& sparse = accessor.at("sparse");
            const auto some = sparse.at("count").get<size_t>();
            const IntegerType* indexType = integerType(sparse.at("indices").at("componentType"));
            if (!indexType) throw mSource.cutShort();
            const Elements indices(*this, sparse.at("indices"), some, indexType->size);
            const Elements values(*this, sparse.at("values"), some, parts * type.size);
            for (size_t n = 0; n < some; ++n) {
                const auto index = static_cast<size_t>(indexType->convert(indices[n], false));
                if (index >= count) throw mSource.cutShort();
                convert(values[n], index);
            }
        }
        return numbers;
    }

    /// The elements of an accessor, of the indices or of the values of a sparse accessor.
    class Elements {
      public:
        Elements(FloatCopier& copier, const json& place, size_t count, size_t size) : mStride(size) {
            const json& view = copier.mRoot.at("bufferViews").at(place.at("bufferView").get<size_t>());
            const std::string& buffer = copier.bufferOf(view.at("buffer"));
            const size_t begin = view.value("byteOffset", size_t{0}), length = view.at("byteLength");
            const size_t offset = place.value("byteOffset", size_t{0});
            mStride = std::max(view.value("byteStride", size), size);
            if (begin > buffer.size() || length > buffer.size() - begin || offset > length ||
                (count > 0 && (size > length - offset || count - 1 > (length - offset - size) / mStride)))
                throw copier.mSource.cutShort();
            mFirst = buffer.data() + begin + offset;
        }
        const char* operator[](size_t n) const { return mFirst + n * mStride; }

      private:
        const char* mFirst = nullptr;
        size_t mStride;
    };

    /// Returns the bytes of a buffer: of the file's second chunk, of a data URI, or of a separate file.
    const std::string& bufferOf(size_t number) {
        const auto [found, isNew] = mBuffers.try_emplace(number);
        if (!isNew) return found->second;
        const json& buffer = mRoot.at("buffers").at(number);
        if (!buffer.contains("uri")) {
            if (!isBinary()) throw mSource.error("it has a buffer without uri; it is damaged");
            const std::string& file = original();
            const size_t begin = kHeaderSize + kChunkHeaderSize + jsonSize() + kChunkHeaderSize;
            return found->second = begin < file.size() ? file.substr(begin) : std::string();
        }
        const auto uri = buffer.at("uri").get<std::string>();
        constexpr std::string_view kBase64 = ";base64,";
        const size_t data = uri.find(kBase64);
        return found->second = uri.starts_with("data:") && data != std::string::npos
                                   ? decoded(std::string_view(uri).substr(data + kBase64.size()))
                                   : contentOf(mPath.parent_path() / uri);
    }

    /// Decodes base64. Throws FileError if a character does not belong to it.
    std::string decoded(std::string_view text) const {
        using namespace boost::archive::iterators;
        using Bytes = transform_width<binary_from_base64<const char*>, 8, 6>;
        while (text.ends_with('=')) text.remove_suffix(1);
        const size_t size = text.size() * 6 / 8;
        std::string bytes;
        bytes.reserve(size);
        try {
            Bytes next(text.data());
            for (size_t k = 0; k < size; ++k, ++next) bytes.push_back(*next);
        } catch (const dataflow_exception&) {
            throw mSource.error("a buffer in it is not base64; it is damaged");
        }
        return bytes;
    }

    const std::string& original() {
        if (mOriginal.empty()) mOriginal = contentOf(mPath);
        return mOriginal;
    }
    bool isBinary() { return original().starts_with("glTF") && original().size() >= kHeaderSize + kChunkHeaderSize; }
    size_t jsonSize() {
        uint32_t size = 0;
        if (isBinary()) std::memcpy(&size, original().data() + kHeaderSize, sizeof size);
        return size;
    }

    /// Returns the file with other JSON.
    std::string fileOf(std::string text) {
        if (!isBinary()) return text;
        text.resize((text.size() + 3) / 4 * 4, ' ');
        const size_t end = std::min(kHeaderSize + kChunkHeaderSize + jsonSize(), original().size());
        const std::string_view others = std::string_view(original()).substr(end);
        std::string file = original().substr(0, 8);
        append(file, static_cast<uint32_t>(kHeaderSize + kChunkHeaderSize + text.size() + others.size()));
        append(file, static_cast<uint32_t>(text.size()));
        file.append("JSON").append(text).append(others);
        return file;
    }

    const std::filesystem::path& mPath;
    const MeshSource& mSource;
    json mRoot;
    std::string mOriginal;                            ///< The file; read when it is needed.
    std::unordered_map<size_t, std::string> mBuffers; ///< Those that were needed.
    std::set<size_t> mWanted;                         ///< Accessors that the copy has as floats.
    std::set<size_t> mDecoded;                        ///< Accessors that Assimp decodes from Draco, to floats if told.
    std::string mFloats;
};

std::optional<GltfCopy> copyOf(const std::filesystem::path& path, const MeshSource& source) {
    const auto checkDepth = [&](int depth, json::parse_event_t, json&) {
        if (depth > kDeepest)
            throw source.error(fmt::format("its JSON is nested more than {} levels deep; it is damaged", kDeepest));
        return true;
    };
    json root = json::parse(gltfJson(path), checkDepth, false);
    if (!root.is_object()) return {}; // Assimp says what is wrong
    try {
        return FloatCopier(path, source, std::move(root)).copy();
    } catch (const json::exception& error) {
        throw source.error(fmt::format("its JSON is not that of a glTF ({}); it is damaged", error.what()));
    } catch (const std::out_of_range&) {
        throw source.error("it has an accessor of a type that does not exist; it is damaged");
    }
}

/// Gives Assimp the copy instead of the file.
class CopyIo : public Assimp::DefaultIOSystem {
  public:
    CopyIo(std::string path, GltfCopy copy) : mPath(std::move(path)), mCopy(std::move(copy)) {}

    bool Exists(const char* name) const override { return contentFor(name) || DefaultIOSystem::Exists(name); }
    Assimp::IOStream* Open(const char* name, const char* mode) override {
        const std::string* content = contentFor(name);
        if (!content) return DefaultIOSystem::Open(name, mode);
        return new Assimp::MemoryIOStream(reinterpret_cast<const uint8_t*>(content->data()), content->size());
    }

  private:
    const std::string* contentFor(std::string_view name) const {
        if (name == mPath) return &mCopy.file;
        return name.ends_with(kFloatsName) ? &mCopy.floats : nullptr;
    }

    std::string mPath;
    GltfCopy mCopy;
};

} // namespace

std::string gltfJson(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::array<char, kHeaderSize + kChunkHeaderSize> head{};
    in.read(head.data(), head.size());
    std::string text;
    if (in && std::string_view(head.data(), 4) == "glTF") {
        uint32_t size = 0;
        std::memcpy(&size, head.data() + kHeaderSize, sizeof size);
        std::error_code error;
        const auto whole = std::filesystem::file_size(path, error);
        text.resize(error ? 0 : std::min<uintmax_t>(size, whole));
    } else {
        in.clear();
        in.seekg(0, std::ios::end);
        text.resize(static_cast<size_t>(std::max<std::streamoff>(in.tellg(), 0)));
        in.seekg(0);
    }
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<size_t>(in.gcount()));
    return text;
}

void readIntegersAsFloats(Assimp::Importer& importer, const std::filesystem::path& path, const MeshSource& source) {
    if (auto copy = copyOf(path, source))
        importer.SetIOHandler(new CopyIo(path.string(), std::move(*copy))); // the importer owns it
}

} // namespace curlew
