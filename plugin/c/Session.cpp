#include "Arrays.h"
#include "Handle.h"
#include "curlew/app/Program.h"
#include "curlew/app/Registry.h"
#include "curlew/base/Memory.h"

using namespace curlew;
using namespace curlew::c;

class curlew_session::Running {
  public:
    Running(curlew_session& session, const curlew_callbacks* callbacks) : mSession(session) {
        if (session.running.exchange(true)) throw ValueError("the session is running already");
        session.caller.begin(callbacks);
        session.session.clock.reset();
        session.session.place = {};
        session.console.setVerbosity(app::Verbosity::normal);
        session.session.onFrame = [&session](int frame) {
            session.inFrame = std::this_thread::get_id();
            session.caller.frame(frame);
            session.inFrame = std::thread::id();
        };
    }
    ~Running() {
        mSession.inFrame = std::thread::id();
        mSession.session.resetThreads();
        mSession.caller.end();
        mSession.running = false;
    }
    Running(const Running&) = delete;
    Running& operator=(const Running&) = delete;

  private:
    curlew_session& mSession;
};

namespace {

const char* nameOr(const char* name) { return name ? name : "scene"; }

std::string nameOfProvided(const char* name) {
    std::string text = &required(name, "the name");
    if (text.empty()) throw ValueError("the name is empty");
    return text;
}

size_t sizeOf(const curlew_array& array) { return static_cast<size_t>(array.count); }

/// Throws ValueError, with what it is, where one of the numbers is not finite.
std::vector<Vec3d> vectorsOf(const curlew_array& array, const char* what) {
    checkArray(array, what, 3, Numbers::floats);
    requireMemory(static_cast<double>(array.count) * 64, fmt::format("{} items of {}", array.count, what),
                  "give fewer");
    std::vector<Vec3d> vectors(sizeOf(array));
    const ptrdiff_t stride = strideOf(array);
    for (size_t k = 0; k < vectors.size(); ++k)
        for (size_t axis = 0; axis < 3; ++axis) {
            const double number = realAt(array, stride, k, axis);
            if (!std::isfinite(number)) throw ValueError(fmt::format("{} {} is not a finite number", what, k));
            vectors[k][static_cast<int>(axis)] = number;
        }
    return vectors;
}

/// The integers one after another. Throws ValueError for those that are negative or too large for a mesh.
std::vector<uint32_t> indicesOf(const curlew_array& array, const char* what, int components) {
    checkArray(array, what, components, Numbers::integers);
    requireMemory(static_cast<double>(array.count) * 4 * components, fmt::format("{} items of {}", array.count, what),
                  "give fewer");
    std::vector<uint32_t> indices;
    indices.reserve(sizeOf(array) * static_cast<size_t>(components));
    const ptrdiff_t stride = strideOf(array);
    for (size_t k = 0; k < sizeOf(array); ++k)
        for (size_t c = 0; c < static_cast<size_t>(components); ++c) {
            const int64_t index = integerAt(array, stride, k, c);
            if (index < 0 || index >= int64_t{UINT32_MAX})
                throw ValueError(fmt::format("{} {} cannot be {}", what, k, index));
            indices.push_back(static_cast<uint32_t>(index));
        }
    return indices;
}

Mesh meshOf(const curlew_array& points, const curlew_array& corners, const curlew_array* sizes) {
    if (!sizes && corners.components != 3 && corners.components != 4)
        throw ValueError(
            fmt::format("corners must have 3 or 4 components where there are no sizes, not {}", corners.components));
    std::vector<openvdb::Vec3s> positions;
    for (const Vec3d& p : vectorsOf(points, "points")) positions.emplace_back(p[0], p[1], p[2]);
    const auto indices = indicesOf(corners, "corners", sizes ? 1 : corners.components);
    const auto faces = sizes ? indicesOf(*sizes, "sizes", 1)
                             : std::vector<uint32_t>(sizeOf(corners), static_cast<uint32_t>(corners.components));
    return curlew::meshOf(positions, indices, faces);
}

Particles particlesOf(const curlew_array& positions, const curlew_array* ids, const curlew_array* velocities) {
    Particles particles;
    for (const Vec3d& p : vectorsOf(positions, "positions")) {
        particles.id.push_back(static_cast<int64_t>(particles.size()));
        particles.x.push_back(p[0]), particles.y.push_back(p[1]), particles.z.push_back(p[2]);
    }
    const auto requireAll = [&](const curlew_array& array, const char* what) {
        if (array.count != positions.count)
            throw ValueError(fmt::format("there are {} positions, but {} {}", positions.count, array.count, what));
    };
    if (ids) {
        checkArray(*ids, "ids", 1, Numbers::integers);
        requireAll(*ids, "ids");
        for (size_t k = 0; k < particles.size(); ++k) particles.id[k] = integerAt(*ids, strideOf(*ids), k, 0);
    }
    if (velocities) {
        requireAll(*velocities, "velocities");
        for (const Vec3d& v : vectorsOf(*velocities, "velocities")) {
            particles.vx.push_back(static_cast<float>(v[0]));
            particles.vy.push_back(static_cast<float>(v[1]));
            particles.vz.push_back(static_cast<float>(v[2]));
        }
    }
    return particles;
}

/// What a function has made once, or NULL.
template <class Make>
const char* onceText(const Make& make) {
    static std::string text;
    return guarded([&] {
               static const bool made = [&] {
                   text = make();
                   return true;
               }();
               static_cast<void>(made);
           }) == CURLEW_OK
               ? text.c_str()
               : nullptr;
}

} // namespace

extern "C" {

int32_t curlew_abi_version(void) { return CURLEW_ABI_VERSION; }

const char* curlew_version(void) {
    return onceText([] {
        std::string text = app::versionText();
        text.pop_back();
        return text;
    });
}

const char* curlew_registry(void) {
    return onceText([] { return app::registryJson(); });
}

curlew_status curlew_session_create(curlew_session** session) {
    return guarded([&] {
        required(session, "the pointer to the session") = nullptr;
        *session = new curlew_session;
    });
}

void curlew_session_release(curlew_session** session) {
    if (session) delete std::exchange(*session, nullptr);
}

curlew_status curlew_provide_mesh(curlew_session* session, const char* name, const curlew_array* points,
                                  const curlew_array* corners, const curlew_array* sizes) {
    return guarded([&] {
        app::Session& s = required(session, "the session").writable();
        s.provided.insert_or_assign(
            nameOfProvided(name),
            std::make_shared<const Mesh>(meshOf(required(points, "points"), required(corners, "corners"), sizes)));
    });
}

curlew_status curlew_provide_points(curlew_session* session, const char* name, const curlew_array* positions,
                                    const curlew_array* ids, const curlew_array* velocities) {
    return guarded([&] {
        app::Session& s = required(session, "the session").writable();
        s.provided.insert_or_assign(nameOfProvided(name),
                                    particlesOf(required(positions, "positions"), ids, velocities));
    });
}

curlew_status curlew_withdraw(curlew_session* session, const char* name) {
    return guarded([&] {
        app::Session& s = required(session, "the session").writable();
        if (s.provided.erase(nameOfProvided(name)) == 0)
            throw ValueError(fmt::format("nothing is provided as '{}'", name));
    });
}

curlew_status curlew_run(curlew_session* session, const char* text, const char* name,
                         const curlew_callbacks* callbacks) {
    app::Place place;
    return guarded(
        [&] {
            curlew_session& s = required(session, "the session");
            const curlew_session::Running running(s, callbacks);
            const app::Program program = app::parseScene(&required(text, "the text"), nameOr(name), &place);
            try {
                app::run(program, s.session);
            } catch (...) {
                place = s.session.place;
                throw;
            }
        },
        place);
}

curlew_status curlew_check(const char* text, const char* name) {
    app::Place place;
    return guarded([&] { app::parseScene(&required(text, "the text"), nameOr(name), &place); }, place);
}

curlew_status curlew_cancel(curlew_session* session) {
    return guarded([&] { required(session, "the session").caller.cancel(); });
}
}
