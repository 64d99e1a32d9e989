#include "Checkpoint.h"

#include "curlew/base/AtomicFile.h"
#include "curlew/base/Random.h"

#include <bit>
#include <cstring>
#include <fstream>

namespace curlew::app {

namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they are in memory");

constexpr uint64_t kMagic = 0x31746b63776c7243; // "Crlwckt1"; the last one is the version

/// The digest of a sequence of words: each is mixed with all before it.
class Digest {
  public:
    void add(const void* data, size_t bytes) {
        const auto* from = static_cast<const char*>(data);
        for (; bytes >= sizeof(uint64_t); bytes -= sizeof(uint64_t), from += sizeof(uint64_t)) {
            uint64_t word = 0;
            std::memcpy(&word, from, sizeof word);
            mState = mixBits(mState ^ word);
        }
        uint64_t rest = bytes;
        for (size_t k = 0; k < bytes; ++k) rest = rest << 8 | static_cast<unsigned char>(from[k]);
        mState = mixBits(mState ^ rest);
    }
    uint64_t value() const { return mState; }

  private:
    uint64_t mState = kMagic;
};

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
    uint64_t digest() const { return mDigest.value(); }

  private:
    void raw(const void* data, size_t bytes) {
        mDigest.add(data, bytes);
        mOut.write(static_cast<const char*>(data), static_cast<std::streamsize>(bytes));
    }
    std::ostream& mOut;
    Digest mDigest;
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
    /// Of what has been read.
    uint64_t digest() const { return mDigest.value(); }
    uintmax_t left() const { return mLeft; }
    FileError damaged() const {
        return FileError(
            fmt::format("'{}' is damaged, or no checkpoint; remove it, and run again without -resume", mPath.string()));
    }

  private:
    void raw(void* data, size_t bytes) {
        if (bytes > mLeft || !mIn.read(static_cast<char*>(data), static_cast<std::streamsize>(bytes))) throw damaged();
        mLeft -= bytes;
        mDigest.add(data, bytes);
    }
    const std::filesystem::path& mPath;
    std::ifstream mIn;
    uintmax_t mLeft;
    Digest mDigest;
};

struct Points {
    uint64_t made = 0;
    Particles particles = {};
};

/// What a checkpoint holds beside the program.
struct State {
    int frame = 0;
    uint64_t now = 0, trackedFlow = 0;
    Emissions emissions = {};
    std::vector<Points> points = {};
};

template <class Map>
void writeMap(Writer& writer, const Map& map) {
    writer.number(uint64_t{map.size()});
    for (const auto& [key, value] : map) {
        writer.number(uint64_t{key});
        writer.number(value);
    }
}

template <class Key, class Value>
void readMap(Reader& reader, std::map<Key, Value>& map) {
    const auto size = reader.number<uint64_t>();
    for (uint64_t k = 0; k < size; ++k) {
        const auto key = reader.number<uint64_t>();
        map[key] = reader.number<Value>();
    }
}

State readState(Reader& reader) {
    State state{
        .frame = reader.number<int32_t>(), .now = reader.number<uint64_t>(), .trackedFlow = reader.number<uint64_t>()};
    readMap(reader, state.emissions.rates);
    readMap(reader, state.emissions.nextIds);
    const auto sets = reader.number<uint64_t>();
    for (uint64_t k = 0; k < sets; ++k) {
        Points& points = state.points.emplace_back();
        points.made = reader.number<uint64_t>();
        forEachArray(points.particles, [&](auto& values) { reader.array(values); });
    }
    const uint64_t digest = reader.digest();
    if (reader.number<uint64_t>() != digest || reader.left() != 0) throw reader.damaged();
    return state;
}

/// The points take the places that they had; meshes stay.
void restore(State& state, Session& session) {
    auto& entries = session.geometry.entries();
    std::erase_if(entries, [](const auto& entry) { return std::holds_alternative<Particles>(entry.object); });
    for (Points& points : state.points) entries.push_back({std::move(points.particles), points.made});
    std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.made < b.made; });
    session.setNextNow(state.now);
    session.trackedFlow = state.trackedFlow;
    session.emissions = state.emissions;
}

} // namespace

uint64_t digestOf(std::string_view text) {
    Digest digest;
    digest.add(text.data(), text.size());
    return digest.value();
}

void writeCheckpoint(const std::filesystem::path& path, uint64_t program, const Session& session) {
    writeAtomically(
        path,
        [&](std::ostream& out) {
            Writer writer(out);
            writer.number(kMagic);
            writer.number(program);
            writer.number(int32_t{session.clock->frame});
            writer.number(session.nextNow());
            writer.number(session.trackedFlow);
            writeMap(writer, session.emissions.rates);
            writeMap(writer, session.emissions.nextIds);
            std::vector<const Stack<Geometry>::Entry*> sets;
            for (const auto& entry : session.geometry.entries())
                if (std::holds_alternative<Particles>(entry.object)) sets.push_back(&entry);
            writer.number(uint64_t{sets.size()});
            for (const auto* entry : sets) {
                writer.number(entry->made);
                forEachArray(std::get<Particles>(entry->object), [&](const auto& values) { writer.array(values); });
            }
            writer.number(uint64_t{writer.digest()});
        },
        session.console.cancelFunction());
}

std::optional<int> restoreCheckpoint(const std::filesystem::path& path, uint64_t program, Session& session) {
    if (!std::filesystem::exists(path)) return {};
    Reader reader(path);
    if (reader.number<uint64_t>() != kMagic) throw reader.damaged();
    if (reader.number<uint64_t>() != program)
        throw FileError(
            fmt::format("the checkpoint '{}' is of another program; remove it, or run that one", path.string()));
    State state = readState(reader);
    restore(state, session);
    return state.frame;
}

} // namespace curlew::app
