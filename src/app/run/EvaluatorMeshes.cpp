// SPDX-License-Identifier: Apache-2.0
#include "Evaluator.h"
#include "SdfCache.h"
#include "curlew/base/Error.h"

#include <algorithm>

namespace curlew::app {

// Meshes that move from frame to frame, the level sets made from them, and level sets that -move moves. The mesh may
// come from any node of the frames, as long as its faces do not change.

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

/// Returns an object in a frame; an empty one if there is none or it cannot be made.
Value Evaluator::valueIn(const Link& link, const FrameClock& clock) {
    if (link.from != Link::From::node || mAdvances[link.index]) return {};
    try {
        const ResultPointer result = resultInFrame(link.index, clock);
        return result && link.output < result->outputs.size() ? result->outputs[link.output] : Value{};
    } catch (const Interrupted&) {
        throw;
    } catch (const Error&) {
        return {}; // the frame is outside of the available ones
    }
}

/// Returns the mesh in a frame; null if there is none or it cannot be read.
MeshPointer Evaluator::meshIn(const Link& mesh, const FrameClock& clock) {
    const Value value = valueIn(mesh, clock);
    const auto* found = std::get_if<MeshPointer>(&value);
    return found ? *found : nullptr;
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

namespace {

/// Returns the rigid fit of one mesh to another, or of a level set that -move has placed to where it has placed it
/// later; the residual is infinite if it is not the same body.
RigidFit fitOf(const Value& from, const Value& to) {
    const auto *mesh = std::get_if<MeshPointer>(&from), *moved = std::get_if<MeshPointer>(&to);
    if (mesh && moved && *mesh && *moved && correspond(**mesh, **moved)) return rigidFit(**mesh, **moved);
    const auto *grid = std::get_if<GridValue>(&from), *later = std::get_if<GridValue>(&to);
    if (grid && later && grid->placed && later->placed && grid->placed->original == later->placed->original &&
        grid->placed->scale == later->placed->scale)
        return {.home = grid->placed->pose, .now = later->placed->pose};
    RigidFit none;
    none.residual = std::numeric_limits<double>::infinity();
    return none;
}

} // namespace

/// Returns the rigid fit of a mesh or a placed level set in the first frame to that in this one; nullptr if the motion
/// is not rigid.
const RigidFit* Evaluator::fitIn(const Link& moved, const FrameClock& clock) {
    const std::pair key(moved, clock.frame);
    auto known = mFits.find(key);
    if (known == mFits.end())
        known = mFits.emplace(key, fitOf(valueIn(moved, mPlan->startClock()), valueIn(moved, clock))).first;
    return known->second.rigid() ? &known->second : nullptr;
}

/// Returns a rigid body at the fraction `part` of the way to this frame; nullopt if the level set or its mesh is not
/// rigid.
std::optional<RigidBody> Evaluator::bodyAt(const Link& levelSet, const FrameClock& clock, double part) {
    if (!mPlan || levelSet.from != Link::From::node || steady(levelSet)) return {};
    const auto mesh = meshOf(levelSet);
    if (!mesh) {
        const ResultPointer& now = mResults[levelSet.index];
        const auto* grid = now && levelSet.output < now->outputs.size()
                               ? std::get_if<GridValue>(&now->outputs[levelSet.output])
                               : nullptr;
        if (!grid || !grid->placed) return {};
    }
    const Link moved = mesh ? *mesh : levelSet;
    // It is rigid if it is so in all frames that its motion depends on, as far as they exist. One that changes its form
    // may have that of the first frame again.
    const RigidFit* to = fitIn(moved, clock);
    if (!to) return {};
    bool rigid = true;
    const auto poseIn = [&](const FrameClock& at) -> std::optional<Pose> {
        if (const RigidFit* fit = fitIn(moved, at)) return fit->now;
        rigid = rigid && std::holds_alternative<std::monostate>(valueIn(moved, at));
        return {};
    };
    PoseKeys keys{.from = to->now, .to = to->now, .after = poseIn(mPlan->clock(clock.frame + mPlan->by))};
    if (clock.duration > 0) {
        const FrameClock before = frameBefore(clock);
        const auto from = poseIn(before);
        if (!from && part < 1) return {};
        keys.from = from.value_or(to->now);
        if (before.frame > mPlan->start) keys.before = poseIn(frameBefore(before));
    }
    if (!rigid) return {};
    auto& first = mFirstForms[levelSet];
    if (!first) {
        const ResultPointer result = resultInFrame(levelSet.index, mPlan->startClock());
        first = std::make_shared<const GridValue>(std::get<GridValue>(result->outputs.at(levelSet.output)));
    }
    return RigidBody{.first = first, .home = to->home, .now = part < 1 ? poseBetween(keys, part) : to->now};
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
    if (grid && clock && (grid->mesh || grid->placed) && link.from == Link::From::node)
        grid->body = bodyAt(link, *clock, 1);
    return value;
}

} // namespace curlew::app
