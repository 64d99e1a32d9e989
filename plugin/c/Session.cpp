// SPDX-License-Identifier: Apache-2.0
#include "Arrays.h"
#include "Handle.h"
#include "curlew/app/Version.h"
#include "curlew/app/actions/Actions.h"
#include "curlew/base/Isolated.h"
#include "curlew/base/Memory.h"
#include "curlew/field/CallbackField.h"

using namespace curlew;
using namespace curlew::c;

class curlew_session::Running {
  public:
    Running(curlew_session& session, const curlew_callbacks* callbacks) : mSession(session) {
        {
            const std::lock_guard lock(session.starting);
            if (session.running) throw ValueError("the session is already running");
            session.caller.begin(callbacks);
            session.running = true;
        }
        session.session.location = {};
        session.forgetFound();
        session.console.setVerbosity(app::Verbosity::normal);
        session.session.onFrame = [&session](int frame) {
            session.inFrame = std::this_thread::get_id();
            session.forgetFound();
            session.caller.frame(frame);
            session.inFrame = std::thread::id();
        };
    }
    ~Running() {
        mSession.inFrame = std::thread::id();
        mSession.session.resetThreads();
        mSession.session.gpu.reset();
        const std::lock_guard lock(mSession.starting);
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

/// Throws ValueError, naming the array, if a number is not finite.
std::vector<Vec3d> vectorsOf(const curlew_array& array, const char* what) {
    checkArray(array, what, 3, Numbers::floats);
    requireMemory(static_cast<double>(array.count) * 64, fmt::format("{} items of {}", array.count, what),
                  "give fewer");
    std::vector<Vec3d> vectors(sizeOf(array));
    const ptrdiff_t stride = strideOf(array);
    for (size_t k = 0; k < vectors.size(); ++k)
        for (size_t axis = 0; axis < 3; ++axis) {
            const double number = realAt(array, stride, k, axis);
            if (!std::isfinite(number)) throw ValueError(fmt::format("{}[{}] is not a finite number", what, k));
            vectors[k][static_cast<int>(axis)] = number;
        }
    return vectors;
}

/// Returns all integers of the array. Throws ValueError if one is negative or too large for a mesh.
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
                throw ValueError(fmt::format("{}[{}] cannot be {}", what, k, index));
            indices.push_back(static_cast<uint32_t>(index));
        }
    return indices;
}

Mesh meshOf(const curlew_array& points, const curlew_array& corners, const curlew_array* sizes) {
    if (!sizes && corners.components != 3 && corners.components != 4)
        throw ValueError(
            fmt::format("corners must have 3 or 4 components if there are no sizes, not {}", corners.components));
    std::vector<openvdb::Vec3s> positions;
    for (const Vec3d& p : vectorsOf(points, "points")) positions.emplace_back(p[0], p[1], p[2]);
    const auto indices = indicesOf(corners, "corners", sizes ? 1 : corners.components);
    const auto faces = sizes ? indicesOf(*sizes, "sizes", 1)
                             : std::vector<uint32_t>(sizeOf(corners), static_cast<uint32_t>(corners.components));
    return curlew::meshOf(positions, indices, faces);
}

Points pointsOf(const curlew_array& positions, const curlew_array* ids, const curlew_array* velocities) {
    Points particles;
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

Curves curvesOf(const curlew_array& positions, const curlew_array& edges) {
    const std::vector<uint32_t> ends = indicesOf(edges, "edges", 2);
    std::vector<CurveEdge> pairs;
    for (size_t k = 0; k < ends.size(); k += 2) pairs.push_back({ends[k], ends[k + 1]});
    return curlew::curvesOf(vectorsOf(positions, "positions"), pairs);
}

void addItems(DigestBuilder& digest, const auto& items) {
    digest.add(items.size());
    if (!items.empty()) digest.addBytes(items.data(), items.size() * sizeof items.front());
}

Digest contentOf(const Mesh& mesh) {
    DigestBuilder digest;
    addItems(digest, mesh.points), addItems(digest, mesh.triangles), addItems(digest, mesh.quads);
    return digest.digest();
}

Digest contentOf(const Points& particles) {
    DigestBuilder digest;
    forEachArray(particles, [&](const auto& values) { addItems(digest, values); });
    return digest.digest();
}

Digest contentOf(const Curves& curves) {
    DigestBuilder digest;
    digest.add("curves");
    for (const auto* values : {&curves.x, &curves.y, &curves.z}) addItems(digest, *values);
    addItems(digest, curves.start), addItems(digest, curves.downstream);
    return digest.digest();
}

/// Returns the text that `make` returned at the first call; NULL if it failed.
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

/// Accepts missing files, since they may be created later.
app::Reading lenient(app::SourceLocation& location) {
    return {.registry = app::registry(), .world = {.lenient = true}, .location = &location};
}

/// Runs a text on the session's objects; if `anew`, runs a graph that replaces them.
curlew_status ran(curlew_session* session, const char* text, const char* name, const curlew_callbacks* callbacks,
                  bool anew) {
    app::SourceLocation location;
    return guarded(
        [&] {
            curlew_session& s = required(session, "the session");
            const curlew_session::Running running(s, callbacks);
            if (anew) s.session.clear();
            app::Reading reading{.registry = app::registry(),
                                 .world = s.session.world(),
                                 .given = s.session.given(),
                                 .location = &location};
            app::Graph graph = anew ? app::graphOfText(&required(text, "the graph"), nameOr(name), reading)
                                    : app::graphOfScene(&required(text, "the text"), nameOr(name), reading);
            try {
                s.session.run(std::move(graph));
            } catch (...) {
                location = s.session.location;
                throw;
            }
        },
        location);
}

} // namespace

namespace {

template <int N>
app::AnyField fieldOf(const std::string& name, curlew_field_function function, void* user) {
    return callbackField<N>(
        [name, function, user](size_t count, const double* positions, double* values, double* gradients) {
            if (function(user, static_cast<int64_t>(count), positions, values, gradients) != 0)
                throw ValueError(fmt::format("the function of the field '{}' has failed", name));
        });
}

app::AnyField fieldOf(const std::string& name, int32_t dimension, curlew_field_function function, void* user) {
    switch (dimension) {
        case 1:
            return fieldOf<1>(name, function, user);
        case 2:
            return fieldOf<2>(name, function, user);
        case 3:
            return fieldOf<3>(name, function, user);
        case 4:
            return fieldOf<4>(name, function, user);
        case 5:
            return fieldOf<5>(name, function, user);
        case 6:
            return fieldOf<6>(name, function, user);
        case 7:
            return fieldOf<7>(name, function, user);
        default:
            throw ValueError(fmt::format("a field of {} dimensions; give 1 to 7", dimension));
    }
}

} // namespace

extern "C" {

int32_t curlew_abi_version(void) { return CURLEW_ABI_VERSION; }

const char* curlew_version(void) {
    return onceText([] { return app::versionLine(); });
}

const char* curlew_registry(void) {
    return onceText([] { return app::registryJson(app::registry()); });
}

curlew_status curlew_session_create(curlew_session** session) {
    return guarded([&] {
        required(session, "the pointer to the session") = nullptr;
        *session = new curlew_session;
    });
}

curlew_status curlew_session_release(curlew_session** session) {
    return guarded([&] {
        if (!session || !*session) return;
        {
            const std::lock_guard lock((*session)->starting);
            if ((*session)->running)
                throw ValueError("the session is running; cancel it, and release it when the run has returned");
        }
        delete std::exchange(*session, nullptr);
    });
}

curlew_status curlew_provide_mesh(curlew_session* session, const char* name, const curlew_array* points,
                                  const curlew_array* corners, const curlew_array* sizes) {
    return guarded([&] {
        app::Session& s = required(session, "the session").writable();
        const std::string key = nameOfProvided(name);
        auto mesh =
            std::make_shared<const Mesh>(meshOf(required(points, "points"), required(corners, "corners"), sizes));
        const Digest content = contentOf(*mesh);
        s.provide(key, std::move(mesh), content);
    });
}

curlew_status curlew_provide_points(curlew_session* session, const char* name, const curlew_array* positions,
                                    const curlew_array* ids, const curlew_array* velocities) {
    return guarded([&] {
        app::Session& s = required(session, "the session").writable();
        const std::string key = nameOfProvided(name);
        auto set = std::make_shared<app::PointSet>();
        set->particles = pointsOf(required(positions, "positions"), ids, velocities);
        const Digest content = contentOf(set->particles);
        s.provide(key, std::move(set), content);
    });
}

curlew_status curlew_provide_curves(curlew_session* session, const char* name, const curlew_array* positions,
                                    const curlew_array* edges) {
    return guarded([&] {
        app::Session& s = required(session, "the session").writable();
        const std::string key = nameOfProvided(name);
        auto curves =
            std::make_shared<const Curves>(curvesOf(required(positions, "positions"), required(edges, "edges")));
        const Digest content = contentOf(*curves);
        s.provide(key, std::move(curves), content);
    });
}

curlew_status curlew_provide_field(curlew_session* session, const char* name, int32_t dimension,
                                   curlew_field_function function, void* user, int64_t version) {
    return guarded([&] {
        app::Session& s = required(session, "the session").writable();
        const std::string key = nameOfProvided(name);
        if (!function) throw ValueError("the field needs a function; the pointer to it is null");
        app::FieldValue field{.field = fieldOf(key, dimension, function, user)};
        const Digest content = DigestBuilder().add("field").add(dimension).add(version).digest();
        s.provide(key, std::move(field), content);
    });
}

curlew_status curlew_withdraw(curlew_session* session, const char* name) {
    return guarded([&] {
        app::Session& s = required(session, "the session").writable();
        if (!s.withdraw(nameOfProvided(name))) throw ValueError(fmt::format("nothing has been provided as '{}'", name));
    });
}

curlew_status curlew_run(curlew_session* session, const char* text, const char* name,
                         const curlew_callbacks* callbacks) {
    return ran(session, text, name, callbacks, false);
}

curlew_status curlew_run_graph(curlew_session* session, const char* graph, const char* name,
                               const curlew_callbacks* callbacks) {
    return ran(session, graph, name, callbacks, true);
}

curlew_status curlew_check(const char* text, const char* name) {
    app::SourceLocation location;
    return guarded([&] { app::graphOfText(&required(text, "the text"), nameOr(name), lenient(location)); }, location);
}

curlew_status curlew_translate(const char* graph, const char* name, const char* form, const char** text) {
    app::SourceLocation location;
    return guarded(
        [&] {
            static thread_local std::string translated;
            required(text, "the pointer to the text") = nullptr;
            const std::string wanted = &required(form, "the form");
            if (wanted != "json" && wanted != "scene")
                throw ValueError(fmt::format("there is no form '{}'; give json or scene", wanted));
            const app::Graph read = app::graphOfText(&required(graph, "the graph"), nameOr(name), lenient(location));
            translated = wanted == "json" ? app::jsonOf(read) : app::sceneOf(read);
            *text = translated.c_str();
        },
        location);
}

int32_t curlew_read_isolated(int32_t on) {
    int32_t isolated = 0;
    guarded([&] {
        setReadsIsolated(on != 0);
        isolated = readsIsolated() ? 1 : 0;
    });
    return isolated;
}

curlew_status curlew_cancel(curlew_session* session) {
    return guarded([&] {
        curlew_session& s = required(session, "the session");
        const std::lock_guard lock(s.starting);
        if (s.running) s.caller.cancel();
    });
}
}
