// SPDX-License-Identifier: Apache-2.0
#include "Evaluator.h"
#include "SdfCache.h"
#include "curlew/base/Error.h"

#include <algorithm>

namespace curlew::app {

// Meshes that move from frame to frame, and the level sets made from them. The mesh may come from any node of the
// frames, as long as its faces do not change.

/// Returns the mesh that a level set is made from, if that is the node's only input and changes with time.
std::optional<Link> Evaluator::meshOf(const Link& levelSet) const {
    if (levelSet.from != Link::From::node || mAdvances[levelSet.index]) return {};
    const Node& node = mGraph.nodes[levelSet.index];
    const Action& action = node.action();
    if (node.arguments.changes() || node.outputs[levelSet.output].kind != Kind::levelSet) return {};
    std::optional<Link> mesh;
    for (size_t k = 0; k < node.inputs.size(); ++k)
        for (const Link& link : node.inputs[k]) {
            if (mesh || !accepts(action.takes[k].kinds, Kind::mesh)) return {}; // also made from another object
            mesh = link;
        }
    return mesh && !steady(*mesh) ? mesh : std::nullopt;
}

/// Returns the mesh in a frame; null if there is none or it cannot be read.
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
        return {}; // the frame is outside of the available ones
    }
}

namespace {

MeshPointer ifCorresponding(MeshPointer mesh, const Mesh& to) {
    return mesh && correspond(*mesh, to) ? std::move(mesh) : nullptr;
}

} // namespace

/// Returns the mesh in the frames around the interval that ends with this frame; nullopt if the meshes at both ends do
/// not correspond.
std::optional<MeshKeys> Evaluator::meshKeys(const Link& mesh, const FrameClock& clock) {
    if (!mPlan || clock.duration == 0) return {};
    const FrameClock before = frameBefore(clock);
    MeshKeys keys{.before = nullptr, .from = meshIn(mesh, before), .to = meshIn(mesh, clock), .after = nullptr};
    if (!keys.from || !keys.to || !correspond(*keys.from, *keys.to)) return {};
    if (before.frame > mPlan->start) keys.before = ifCorresponding(meshIn(mesh, frameBefore(before)), *keys.to);
    keys.after = ifCorresponding(meshIn(mesh, mPlan->clock(clock.frame + mPlan->by)), *keys.to);
    return keys;
}

/// Lets the surface between the level sets of the previous frame and this one follow the points of their meshes, if
/// these correspond.
void Evaluator::followMesh(const Link& levelSet, const FrameClock& clock, const GridValue& from, const GridValue& to) {
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
    mSession.mSdfs->addDeformation(before ? &*before : nullptr, from, to, *keys, clock.duration);
}

/// Returns the rigid fit of the first frame's mesh to that of this frame; nullptr if the motion is not rigid.
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

/// Returns a rigid body at the fraction `part` of the way to this frame; nullopt if the mesh is not rigid.
std::optional<RigidBody> Evaluator::bodyAt(const Link& levelSet, const FrameClock& clock, double part) {
    if (!mPlan || steady(levelSet)) return {};
    const auto mesh = meshOf(levelSet);
    if (!mesh) return {};
    const RigidFit* to = fitIn(*mesh, clock);
    if (!to) return {};
    // The first frame's mesh always fits itself. Whether it is rigid, the next one shows, if there is one.
    const FrameClock next = mPlan->clock(clock.frame + mPlan->by);
    if (clock.duration == 0 && meshIn(*mesh, next) && !fitIn(*mesh, next)) return {};
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

/// Returns the level set of the first frame as the beginning of its way to the next frame, which need not be one that
/// this process evaluates.
GridValue Evaluator::withWayAhead(const Link& link, const Link& mesh, const GridValue& grid) {
    if (!mPlan) return grid;
    const FrameClock next = mPlan->clock(mClock->frame + mPlan->by);
    if (!meshKeys(mesh, next)) return grid;
    ResultPointer after;
    try {
        after = resultInFrame(link.index, next);
    } catch (const Interrupted&) {
        throw;
    } catch (const Error&) { // the next frame will say so
        return grid;
    }
    const auto* to =
        link.output < after->outputs.size() ? std::get_if<GridValue>(&after->outputs[link.output]) : nullptr;
    if (!to) return grid;
    GridValue with = *to;
    followMesh(link, next, grid, *to);
    with.earlier = std::make_shared<const GridValue>(grid);
    with.part = 0;
    return with;
}

/// Returns a level set with the motion of its surface since the previous frame, or to the next if it is the first, if
/// it is that of this frame and its mesh deforms. So the velocity of the surface is known at the frame too.
GridValue Evaluator::withWay(const Link& link, const GridValue& grid, const Moment& moment) {
    const bool atFrame = mClock && isNow(moment) && !grid.body && !grid.earlier;
    if (!atFrame || !grid.mesh || steady(link)) return grid;
    const auto mesh = meshOf(link);
    if (!mesh) return grid;
    if (mClock->duration == 0) return withWayAhead(link, *mesh, grid);
    const ResultPointer before = resultInFrame(link.index, frameBefore(*mClock));
    if (!before || link.output >= before->outputs.size()) return grid;
    const auto* from = std::get_if<GridValue>(&before->outputs[link.output]);
    if (!from) return grid;
    GridValue with = grid;
    followMesh(link, *mClock, *from, grid);
    with.earlier = std::make_shared<const GridValue>(*from);
    return with;
}

bool dependsOnOtherFrames(const NodeResult& result) {
    const auto known = [](const Value& value) {
        if (const auto* field = std::get_if<FieldValue>(&value)) {
            const auto* wall = field->wall ? std::get_if<Wall>(&*field->wall) : nullptr;
            return wall && wall->sdf.surfaceVelocity.has_value();
        }
        const auto* any = std::get_if<AnyFlow>(&value);
        const auto* flow = any ? std::get_if<Flow>(any) : nullptr;
        return flow && flow->domain().wall && flow->domain().wall->sdf.surfaceVelocity.has_value();
    };
    return std::any_of(result.outputs.begin(), result.outputs.end(), known);
}

/// Returns the level set of a frame, with its rigid body if it has one.
Value Evaluator::asBody(const Link& link, Value value, const std::optional<FrameClock>& clock) {
    auto* grid = std::get_if<GridValue>(&value);
    if (grid && clock && grid->mesh && link.from == Link::From::node) grid->body = bodyAt(link, *clock, 1);
    return value;
}

} // namespace curlew::app
