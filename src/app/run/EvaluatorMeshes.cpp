// SPDX-License-Identifier: Apache-2.0
#include "Evaluator.h"
#include "SdfCache.h"
#include "curlew/base/Error.h"

namespace curlew::app {

// Meshes that move from frame to frame, and the level sets that are made of them. Any node that makes a mesh in each
// frame will do, as long as the faces stay.

/// The mesh that a level set is made of, if a node of the frames makes it of one.
std::optional<Link> Evaluator::meshOf(const Link& levelSet) const {
    if (levelSet.from != Link::From::node || mAdvances[levelSet.index]) return {};
    const Node& node = mGraph.nodes[levelSet.index];
    const Action& action = node.action();
    if (node.arguments.changes() || !action.makesKind(Kind::levelSet)) return {};
    std::optional<Link> mesh;
    for (size_t k = 0; k < node.inputs.size(); ++k)
        for (const Link& link : node.inputs[k]) {
            if (mesh || !accepts(action.takes[k].kinds, Kind::mesh)) return {}; // of something else, too
            mesh = link;
        }
    return mesh && !steady(*mesh) ? mesh : std::nullopt;
}

/// The mesh in a frame; null if there is none, or if it cannot be read.
MeshPointer Evaluator::meshIn(const Link& mesh, const FrameClock& clock) {
    if (mesh.from != Link::From::node || mAdvances[mesh.index]) return {};
    try {
        const ResultPointer result = resultInFrame(mesh.index, clock);
        if (!result || mesh.output >= result->outputs.size()) return {};
        const auto* found = std::get_if<MeshPointer>(&result->outputs[mesh.output]);
        return found ? *found : nullptr;
    } catch (const Interrupted&) {
        throw;
    } catch (const Error&) {
        return {}; // a frame beyond those that are there
    }
}

namespace {

MeshPointer ifCorresponding(MeshPointer mesh, const Mesh& to) {
    return mesh && correspond(*mesh, to) ? std::move(mesh) : nullptr;
}

} // namespace

/// The mesh in the frames around the interval that ends with this one, if it corresponds at both of its ends.
std::optional<MeshKeys> Evaluator::meshKeys(const Link& mesh, const FrameClock& clock) {
    if (!mPlan || clock.duration == 0) return {};
    const FrameClock before = frameBefore(clock);
    MeshKeys keys{.before = nullptr, .from = meshIn(mesh, before), .to = meshIn(mesh, clock), .after = nullptr};
    if (!keys.from || !keys.to || !correspond(*keys.from, *keys.to)) return {};
    if (before.frame > mPlan->start) keys.before = ifCorresponding(meshIn(mesh, frameBefore(before)), *keys.to);
    keys.after = ifCorresponding(meshIn(mesh, mPlan->clock(clock.frame + mPlan->by)), *keys.to);
    return keys;
}

/// If these two level sets, of the frame before and of this one, are of meshes that correspond, what is between them is
/// on the way of the points.
void Evaluator::followWay(const Link& levelSet, const FrameClock& clock, const GridValue& from, const GridValue& to) {
    const auto mesh = meshOf(levelSet);
    if (!mesh) return;
    auto keys = meshKeys(*mesh, clock);
    const auto isOf = [](const GridValue& grid, const MeshPointer& of) {
        return grid.mesh && of && grid.mesh->points == of->points;
    };
    if (!keys || !isOf(from, keys->from) || !isOf(to, keys->to)) return;
    std::optional<GridValue> before;
    if (keys->before) {
        const auto& made = resultInFrame(levelSet.index, frameBefore(frameBefore(clock)))->outputs;
        const auto* grid = levelSet.output < made.size() ? std::get_if<GridValue>(&made[levelSet.output]) : nullptr;
        if (grid && isOf(*grid, keys->before)) before = *grid;
    }
    mSession.mSdfs->setWay(before ? &*before : nullptr, from, to, *keys);
}

/// How the mesh of the first frame fits on that of this one; nullptr if it does not.
const RigidFit* Evaluator::fitIn(const Link& mesh, const FrameClock& clock) {
    const std::pair key(mesh, clock.frame);
    auto known = mFits.find(key);
    if (known == mFits.end()) {
        RigidFit fit;
        fit.residual = std::numeric_limits<double>::infinity();
        const MeshPointer first = meshIn(mesh, mPlan->startClock()), now = meshIn(mesh, clock);
        if (first && now && correspond(*first, *now)) fit = rigidFit(*first, *now);
        known = mFits.emplace(key, fit).first;
    }
    return known->second.rigid() ? &known->second : nullptr;
}

/// Where a rigid body is, `part` of the way to this frame. nullopt if it is none.
std::optional<RigidBody> Evaluator::bodyAt(const Link& levelSet, const FrameClock& clock, double part) {
    if (!mPlan || steady(levelSet)) return {};
    const auto mesh = meshOf(levelSet);
    if (!mesh) return {};
    const RigidFit* to = fitIn(*mesh, clock);
    if (!to) return {};
    PoseKeys keys{.from = to->now, .to = to->now};
    if (clock.duration > 0 && part < 1) {
        const FrameClock before = frameBefore(clock);
        const RigidFit* from = fitIn(*mesh, before);
        if (!from) return {};
        keys.from = from->now;
        if (before.frame > mPlan->start)
            if (const RigidFit* fit = fitIn(*mesh, frameBefore(before))) keys.before = fit->now;
        if (const RigidFit* fit = fitIn(*mesh, mPlan->clock(clock.frame + mPlan->by))) keys.after = fit->now;
    }
    auto& first = mFirstForms[levelSet];
    if (!first) {
        const ResultPointer result = resultInFrame(levelSet.index, mPlan->startClock());
        first = std::make_shared<const GridValue>(std::get<GridValue>(result->outputs.at(levelSet.output)));
    }
    return RigidBody{.first = first, .home = to->home, .now = poseBetween(keys, part)};
}

/// The level set of this frame, with the body that it shows.
Value Evaluator::asBody(const Link& link, Value value) {
    auto* grid = std::get_if<GridValue>(&value);
    if (grid && mClock && grid->mesh && link.from == Link::From::node) grid->body = bodyAt(link, *mClock, 1);
    return value;
}

} // namespace curlew::app
