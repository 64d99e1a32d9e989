// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/run/Context.h"

#include "Evaluator.h"
#include "SdfCache.h"
#include "curlew/app/registry/Text.h"

#include <algorithm>

namespace curlew::app {

Context::Context(Evaluator& evaluator, Console& console, size_t node, const Moment& moment, NodeResult& result)
    : mEvaluator(evaluator), mConsole(console), mNode(node), mMoment(moment), mResult(result) {}

const std::vector<Link>& Context::links(std::string_view input) const {
    const Node& node = graph().nodes[mNode];
    return node.inputs.at(node.action().inputIndex(input));
}

const Link& Context::link(std::string_view input, size_t index) const {
    const auto& all = links(input);
    if (index >= all.size()) throw ValueError(fmt::format("nothing is connected to '{}'", input));
    return all[index];
}

size_t Context::count(std::string_view input) const { return links(input).size(); }

namespace {

/// Returns the object of type T in a value, which is held while the action runs.
template <class T>
const T& held(const Value& value, std::string_view input, const char* what) {
    if (const auto* found = std::get_if<T>(&value)) return *found;
    throw ValueError(fmt::format("'{}' is not {}", input, what));
}

} // namespace

const Value& Context::value(std::string_view input, size_t index) const {
    const Link& wanted = link(input, index);
    for (const auto& [known, value] : mHeld)
        if (known == wanted) return value;
    const Action& action = graph().nodes[mNode].action();
    const auto as = action.evaluation != Evaluation::anyTime ? Evaluator::As::inFrame
                    : action.makesKind(Kind::levelSet)       ? Evaluator::As::samples
                                                             : Evaluator::As::body;
    return mHeld.emplace_back(wanted, mEvaluator.value(wanted, mMoment, as)).second;
}

Kind Context::kind(std::string_view input) const { return kindOf(value(input)); }

const FieldValue& Context::field(std::string_view input, size_t index) const {
    return held<FieldValue>(value(input, index), input, "a field");
}
const AnyFlow& Context::anyFlow(std::string_view input, size_t index) const {
    return held<AnyFlow>(value(input, index), input, "a flow");
}
Flow Context::flow(std::string_view input, size_t index) const { return inSpace(anyFlow(input, index)); }
const GridValue& Context::grid(std::string_view input, size_t index) const {
    return held<GridValue>(value(input, index), input, "a grid");
}
MeshPointer Context::mesh(std::string_view input) const { return held<MeshPointer>(value(input), input, "a mesh"); }
CurvesPointer Context::curves(std::string_view input, size_t index) const {
    return held<CurvesPointer>(value(input, index), input, "curves");
}
const ImageValue& Context::image(std::string_view input, size_t index) const {
    return *held<std::shared_ptr<const ImageValue>>(value(input, index), input, "an image");
}
const PointSet& Context::anyPoints(std::string_view input, size_t index) const {
    return *held<PointsPointer>(value(input, index), input, "points");
}
const PointSet& Context::points(std::string_view input, size_t index) const {
    const PointSet& set = anyPoints(input, index);
    if (set.positionsN)
        throw ValueError(fmt::format("needs points in 3D, but these have {} dimensions", dimensionOf(*set.positionsN)));
    return set;
}

PointSet Context::takePoints(std::string_view input) {
    points(input); // checks the dimension
    const Link& wanted = link(input, 0);
    std::erase_if(mHeld, [&](const auto& known) { return known.first == wanted; });
    return mEvaluator.take(wanted, mNode);
}

FlowInTime Context::flowInTime(std::string_view input) const {
    const Link wanted = link(input, 0);
    Evaluator& evaluator = mEvaluator;
    if (evaluator.steady(wanted)) return flow(input);
    return FlowInTime([&evaluator, wanted](double time) {
        const Value value = evaluator.value(wanted, evaluator.momentAt(time));
        return inSpace(std::get<AnyFlow>(value));
    });
}

Sdf Context::sdf(std::string_view input, double distance) const {
    const Value& wall = value(input);
    if (const auto* shape = std::get_if<FieldValue>(&wall); shape && shape->sdf) return inSpace(*shape->sdf);
    const auto& grid = held<GridValue>(wall, input, "a shape or level set");
    return session().mSdfs->sdf(mEvaluator.withWay(link(input, 0), grid, mMoment), distance, mConsole);
}

Sdf Context::sdfAt(std::string_view input, double time, double distance) const {
    const Value wall = mEvaluator.value(link(input, 0), mEvaluator.momentAt(time));
    if (const auto* shape = std::get_if<FieldValue>(&wall); shape && shape->sdf) return inSpace(*shape->sdf);
    return session().mSdfs->sdf(held<GridValue>(wall, input, "a shape or level set"), distance, mConsole);
}

std::optional<Box> Context::boxBefore(std::string_view input) const {
    const Value before = mEvaluator.value(link(input, 0), mEvaluator.momentAt(clock()->begin));
    const auto* grid = std::get_if<GridValue>(&before);
    return boxOf(grid && grid->earlier && !grid->body ? Value(*grid->earlier) : before);
}

LevelSet Context::levelSet(std::string_view input, double distance) const {
    return session().mSdfs->levelSet(grid(input), distance, mConsole);
}

double Context::diagonal() const {
    for (const Input& input : graph().nodes[mNode].action().takes)
        for (size_t k = 0; k < count(input.name); ++k)
            if (const auto box = boxOf(value(input.name, k))) return length(box->size());
    throw ValueError("a percentage refers to the size of an object, but no input has a finite size; give world units");
}

std::string Context::programOf(std::string_view input, size_t index) const {
    const auto* field = std::get_if<FieldValue>(&value(input, index));
    return field ? field->program : "";
}

Digest Context::keyOf(std::string_view input, size_t index) const { return mEvaluator.keyOf(link(input, index)); }
bool Context::steady(std::string_view input) const { return mEvaluator.steady(link(input, 0)); }

/// Returns the links to level sets behind an input, by the inputs of the nodes that take them.
std::vector<std::vector<Link>> Context::levelSetLinks(std::string_view input) const {
    std::vector<std::vector<Link>> found;
    std::vector<Link> ahead = links(input);
    std::vector<bool> seen(graph().nodes.size());
    while (!ahead.empty()) {
        const Link at = ahead.back();
        ahead.pop_back();
        if (at.from != Link::From::node || seen[at.index]) continue;
        seen[at.index] = true;
        for (const auto& links : graph().nodes[at.index].inputs) {
            const auto isLevelSet = [&](const Link& one) { return graph().objectOf(one).kind == Kind::levelSet; };
            if (!links.empty() && std::all_of(links.begin(), links.end(), isLevelSet))
                found.push_back(links);
            else
                ahead.insert(ahead.end(), links.begin(), links.end());
        }
    }
    return found;
}

bool Context::madeFromLevelSet(std::string_view input) const { return !levelSetLinks(input).empty(); }

std::vector<std::vector<GridValue>> Context::levelSetsBehind(std::string_view input) const {
    std::vector<std::vector<GridValue>> found;
    for (const auto& links : levelSetLinks(input)) {
        std::vector<GridValue> levelSets;
        for (const Link& one : links) {
            const Value level = mEvaluator.value(one, mMoment);
            if (const auto* grid = std::get_if<GridValue>(&level); grid && grid->grid) levelSets.push_back(*grid);
        }
        if (levelSets.size() == links.size()) found.push_back(std::move(levelSets));
    }
    return found;
}

bool Context::used(std::string_view output) const {
    if (session().mKeeps || !graph().wanted.empty()) return true;
    const auto& outputs = graph().nodes[mNode].outputs;
    const auto isIt = [&](const Link& one) {
        return one.from == Link::From::node && one.index == mNode && outputs.at(one.output).name == output;
    };
    for (const Node& node : graph().nodes)
        for (const auto& links : node.inputs)
            if (std::any_of(links.begin(), links.end(), isIt)) return true;
    return false;
}

std::shared_ptr<const void>& Context::keptObject(const Digest& key) const {
    Session::Kept& kept = session().mKept[key];
    kept.used = true;
    return kept.object;
}

TrackedFlow Context::tracked(std::string_view input) const {
    const Link& flow = link(input, 0);
    const bool inFrames = clock() && flow.from == Link::From::node && graph().inFrames(flow.index);
    return {.identity = keyOf(input),
            .frame = inFrames ? clock()->frame : -1,
            .flow = std::make_shared<const AnyFlow>(anyFlow(input))};
}

const AnyFlow* Context::trackedFlow(const PointSet& points) const {
    const TrackedFlow& tracked = points.tracked;
    const bool now = tracked.frame == -1 || (clock() && tracked.frame == clock()->frame);
    return now ? tracked.flow.get() : nullptr;
}

Value Context::provided(const std::string& name) const {
    const auto& provided = session().mProvided;
    const auto found = provided.find(name);
    return found == provided.end() ? Value{} : found->second.value;
}

Json& Context::report(const std::string& name) {
    for (auto& [known, figures] : mResult.figures)
        if (known == name) return figures;
    const Json& all = session().report;
    const auto before = all.find(name);
    return mResult.figures.emplace_back(name, before == all.end() ? Json::object() : *before).second;
}

Json& Context::wholeReport() const { return session().report; }
const std::optional<FrameClock>& Context::clock() const { return mEvaluator.mClock; }
Memory& Context::memory() const { return mEvaluator.mMemories[mNode]; }
Session& Context::session() const { return mEvaluator.mSession; }
const Graph& Context::graph() const { return mEvaluator.mGraph; }

} // namespace curlew::app
