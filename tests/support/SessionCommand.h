// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Catch.h"
#include "curlew/app/actions/Actions.h"
#include "curlew/app/registry/Options.h"
#include "curlew/app/run/Context.h"
#include "support/Points.h"

namespace curlew::test {

inline app::Console& silentConsole() {
    static app::Console console{app::Listener{}};
    return console;
}

/// Every kind of object that can be on a stack.
inline std::vector<app::Kind> allKinds() {
    using app::Kind;
    return {Kind::field, Kind::flow, Kind::grid, Kind::mesh, Kind::points, Kind::curves, Kind::image};
}

/// A session that runs scenes in this process. They can have two actions more than the registry's: `here` calls `look`
/// with all objects that are there ("what"), the newest flow ("flow") and the newest points ("points"); `push` moves
/// the newest points by 1 along x.
class Scenes {
  public:
    explicit Scenes(std::function<void(app::Context&)> look = {}, app::Console& console = silentConsole())
        : session(console) {
        using namespace app::options;
        const auto some = [](app::Input input) { return maybe(std::move(input), "if there is one"); };
        mRegistry.push_back(
            {.name = "here",
             .takes = {several(stays("what", allKinds()), 0, 1000, "all"), some(stays("flow", {app::Kind::flow})),
                       some(stays("points", {app::Kind::points}))},
             .evaluation = app::Evaluation::effect,
             .run = [look = std::move(look)](app::Context& c, const app::Arguments&) {
                 if (look) look(c);
             }});
        mRegistry.push_back({.name = "push",
                             .takes = {changed("points", {app::Kind::points})},
                             .makes = {made("points", {app::Kind::points})},
                             .options = {keep()},
                             .inFrames = app::InFrames::each,
                             .run = [](app::Context& c, const app::Arguments&) {
                                 app::PointSet points = c.takePoints("points");
                                 for (double& x : points.particles.x) x += 1;
                                 c.give(std::make_shared<app::PointSet>(std::move(points)));
                             }});
    }

    /// The graph of a scene or of JSON that goes on from what the session has.
    app::Graph graph(const std::string& text, app::SourceLocation* location = nullptr) const {
        return app::graphOfText(
            text, "scene",
            {.registry = mRegistry, .world = session.world(), .given = session.given(), .location = location});
    }
    app::Session& run(const std::string& text) {
        session.run(graph(text));
        return session;
    }
    /// The same with nothing but the values of the run before.
    app::Session& runAnew(const std::string& text) {
        session.clear();
        return run(text);
    }
    /// What is wrong with a program: the message of the error that reading or running it ends with.
    std::string complaint(const std::string& text) {
        try {
            runAnew(text);
        } catch (const Error& error) {
            return error.what();
        }
        return "nothing is wrong with " + text;
    }
    const app::Registry& registry() const { return mRegistry; }

  private:
    app::Registry mRegistry = app::registry(); // the graphs refer to it

  public:
    app::Session session;
};

/// The objects of these kinds, oldest first.
inline std::vector<app::Session::Held> objectsOf(const app::Session& session, const std::vector<app::Kind>& kinds) {
    std::vector<app::Session::Held> found;
    for (const auto& held : session.objects())
        if (accepts(kinds, kindOf(held.value))) found.push_back(held);
    return found;
}
inline size_t countOf(const app::Session& session, app::Kind kind) { return objectsOf(session, {kind}).size(); }

/// The object of that age, 0 the newest, of a kind.
inline app::Value valueOf(const app::Session& session, app::Kind kind, size_t age = 0) {
    const auto all = objectsOf(session, {kind});
    REQUIRE(age < all.size());
    return all[all.size() - 1 - age].value;
}
inline Points pointsOf(const app::Value& value) { return std::get<app::PointsPointer>(value)->particles; }
inline Points pointsOf(const app::Session& session, size_t age = 0) {
    return pointsOf(valueOf(session, app::Kind::points, age));
}

/// Velocities at some positions.
inline std::vector<Vec3d> velocitiesOf(const Flow& flow) {
    std::vector<Vec3d> velocities;
    for (uint64_t k = 0; k < 40; ++k) velocities.push_back(flow.at(randomPoint(cube(0.9), 11, k)).velocity);
    return velocities;
}

/// The lines of a text.
inline std::vector<std::string> linesOf(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

} // namespace curlew::test
