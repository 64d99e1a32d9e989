// SPDX-License-Identifier: Apache-2.0
#include "Evaluator.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/Memory.h"

#include <bit>
#include <cstring>
#include <fstream>

namespace curlew::app {

namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they are in memory");

constexpr uint64_t kMagic = 0x34746b63776c7243; // "Crlwckt4"; the last character is the version

class Writer {
  public:
    explicit Writer(std::ostream& out) : mOut(out) {}

    template <class T>
    void number(T value) {
        raw(&value, sizeof value);
    }
    template <class T>
    void array(const std::vector<T>& values) {
        number(uint64_t{values.size()});
        raw(values.data(), values.size() * sizeof(T));
    }
    Digest digest() const { return mDigest.digest(); }

  private:
    void raw(const void* data, size_t bytes) {
        mDigest.addBytes(data, bytes);
        mOut.write(static_cast<const char*>(data), static_cast<std::streamsize>(bytes));
    }
    std::ostream& mOut;
    DigestBuilder mDigest;
};

class Reader {
  public:
    explicit Reader(const std::filesystem::path& path)
        : mPath(path), mIn(path, std::ios::binary), mLeft(std::filesystem::file_size(path)) {
        if (!mIn)
            throw FileError(fmt::format("cannot read the checkpoint '{}': {}", path.string(), std::strerror(errno)));
    }

    template <class T>
    T number() {
        T value{};
        raw(&value, sizeof value);
        return value;
    }
    template <class T>
    void array(std::vector<T>& values) {
        const auto size = number<uint64_t>();
        if (size > mLeft / sizeof(T)) throw damaged();
        values.resize(size);
        raw(values.data(), size * sizeof(T));
    }
    /// Returns the digest of the data read so far.
    Digest digest() const { return mDigest.digest(); }
    uintmax_t left() const { return mLeft; }
    FileError damaged() const {
        return FileError(fmt::format("'{}' is damaged or not a checkpoint; remove it and run again without -resume",
                                     mPath.string()));
    }

  private:
    void raw(void* data, size_t bytes) {
        if (bytes > mLeft || !mIn.read(static_cast<char*>(data), static_cast<std::streamsize>(bytes))) throw damaged();
        mLeft -= bytes;
        mDigest.addBytes(data, bytes);
    }
    const std::filesystem::path& mPath;
    std::ifstream mIn;
    uintmax_t mLeft;
    DigestBuilder mDigest;
};

/// Writes or reads the members of a point set other than its arrays. The flow of its track is found again by its
/// identity.
template <class Set, class Number>
void eachNumber(Set& set, const Number& number) {
    number(set.nextId);
    number(set.tracked.identity);
    number(set.tracked.frame);
}

/// Returns whether the sizes of the arrays are consistent. The digest does not ensure this, since a forged file can
/// have a valid digest.
bool isWhole(const Points& p) {
    const auto each = [&p](const auto&... arrays) { return ((arrays.size() == p.size()) && ...); };
    const auto eachOrNone = [&](const auto&... arrays) { return (arrays.empty() && ...) || each(arrays...); };
    return each(p.y, p.z, p.id) && eachOrNone(p.vx, p.vy, p.vz) && eachOrNone(p.f, p.g) && eachOrNone(p.converged) &&
           eachOrNone(p.age) && eachOrNone(p.life) && eachOrNone(p.fade);
}

} // namespace

void writeCheckpoint(const std::filesystem::path& path, const Digest& program, const Checkpoint& checkpoint,
                     const std::function<bool()>& cancelled) {
    writeAtomically(
        path,
        [&](std::ostream& out) {
            Writer writer(out);
            const auto number = [&](const auto& value) { writer.number(value); };
            number(kMagic);
            number(program);
            number(int32_t{checkpoint.frame});
            number(uint64_t{checkpoint.states.size()});
            for (const auto& [set, key] : checkpoint.states) {
                number(key);
                eachNumber(set, number);
                forEachArray(set.particles, [&](const auto& values) { writer.array(values); });
            }
            writer.array(checkpoint.sums);
            number(int32_t{checkpoint.since});
            number(checkpoint.inputs);
            number(writer.digest());
        },
        cancelled);
}

std::optional<Checkpoint> readCheckpoint(const std::filesystem::path& path, const Digest& program) {
    if (!std::filesystem::exists(path)) return {};
    requireMemory(double(std::filesystem::file_size(path)), fmt::format("the checkpoint '{}'", path.string()),
                  "free some memory");
    Reader reader(path);
    const auto number = [&](auto& value) { value = reader.number<std::remove_cvref_t<decltype(value)>>(); };
    if (reader.number<uint64_t>() != kMagic) throw reader.damaged();
    if (reader.number<Digest>() != program)
        throw FileError(fmt::format("the checkpoint '{}' belongs to another program; remove it, or run that program",
                                    path.string()));
    Checkpoint checkpoint{.frame = reader.number<int32_t>()};
    const auto states = reader.number<uint64_t>();
    for (uint64_t k = 0; k < states; ++k) {
        auto& [set, key] = checkpoint.states.emplace_back();
        number(key);
        eachNumber(set, number);
        forEachArray(set.particles, [&](auto& values) { reader.array(values); });
        if (!isWhole(set.particles)) throw reader.damaged();
    }
    reader.array(checkpoint.sums);
    number(checkpoint.since);
    number(checkpoint.inputs);
    const Digest digest = reader.digest();
    if (reader.number<Digest>() != digest || reader.left() != 0) throw reader.damaged();
    return checkpoint;
}

} // namespace curlew::app
