// SPDX-License-Identifier: Apache-2.0
#include "Advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace curlew::app {

namespace {

bool isWall(const Object& object) { return object.kind == Kind::shape || object.kind == Kind::levelSet; }
bool isFlow(const Object& object) { return object.kind == Kind::flow; }

bool takesFlow(const Node& node) {
    return std::any_of(node.action().takes.begin(), node.action().takes.end(), [](const Input& input) {
        return std::find(input.kinds.begin(), input.kinds.end(), Kind::flow) != input.kinds.end();
    });
}

/// Warns about points that are made anew in each frame and then moved by a flow: they only move for one frame.
void adviseOnBirths(const Graph& graph, std::vector<std::string>& advice) {
    for (size_t k = graph.frames; k < graph.nodes.size(); ++k)
        for (size_t i = 0; i < graph.nodes[k].inputs.size(); ++i)
            for (const Link& link : graph.nodes[k].inputs[i]) {
                const Node& node = graph.nodes[k];
                if (link.from != Link::From::node || !graph.inFrames(link.index)) continue;
                const Node& source = graph.nodes[link.index];
                if (source.action().inFrames != InFrames::once || !takesFlow(node) ||
                    !node.action().advances(node.arguments) || node.action().takes[i].use != Use::changed)
                    continue;
                advice.push_back(
                    fmt::format("{} after -frames makes its points again in each frame, so -{} moves them for one "
                                "frame only; put it before -frames, or use -emit for points that are born over time",
                                contextOf(source.location), node.action().name));
            }
}

/// Warns about unused shapes and level sets, and about meshes beside used ones, that are followed by a flow which could
/// have used them.
void adviseOnUnused(const Graph& graph, std::vector<std::string>& advice) {
    std::set<size_t> used;
    std::set<std::pair<size_t, size_t>> usedOutputs;
    for (const Node& node : graph.nodes)
        for (const auto& links : node.inputs)
            for (const Link& link : links)
                if (link.from == Link::From::node) {
                    used.insert(link.index);
                    usedOutputs.emplace(link.index, link.output);
                }
    const bool anyMeshUsed = std::any_of(usedOutputs.begin(), usedOutputs.end(), [&](const auto& output) {
        return graph.nodes[output.first].outputs.at(output.second).kind == Kind::mesh;
    });
    const auto makesFlow = [](const Node& node) {
        return std::any_of(node.outputs.begin(), node.outputs.end(), isFlow);
    };
    const auto lastFlow = std::find_if(graph.nodes.rbegin(), graph.nodes.rend(), makesFlow);
    const auto before = static_cast<size_t>(graph.nodes.rend() - lastFlow);
    for (size_t k = 0; k < before; ++k) {
        const Node& node = graph.nodes[k];
        size_t meshes = 0, unused = 0;
        for (size_t o = 0; o < node.outputs.size(); ++o)
            if (node.outputs[o].kind == Kind::mesh) ++meshes, unused += usedOutputs.contains({k, o}) ? 0 : 1;
        if (unused > 0 && anyMeshUsed)
            advice.push_back(fmt::format("nothing uses {} made by {}; each -mesh2ls makes a level set of one mesh",
                                         meshes == 1 ? "the mesh" : fmt::format("{} of {} meshes", unused, meshes),
                                         contextOf(node.location)));
        if (used.contains(k) || !std::any_of(node.outputs.begin(), node.outputs.end(), isWall)) continue;
        advice.push_back(fmt::format(
            "nothing uses {} made by {}; for a flow around or inside it, give it to -bound (side=outside for an "
            "obstacle) before -dfvn",
            node.outputs.front().kind == Kind::shape ? "the shape" : "the level set", contextOf(node.location)));
    }
}

/// Warns about values that change with time but are evaluated once, before the frames.
void adviseOnFrozen(const Graph& graph, std::vector<std::string>& advice) {
    for (size_t k = 0; graph.frameRange && k < graph.frames; ++k) {
        const Node& node = graph.nodes[k];
        if (!node.action().setting && node.arguments.changes())
            advice.push_back(
                fmt::format("{} changes with the frame or the time, but comes before -frames, so it is "
                            "evaluated once, for frame 1; put it after -frames",
                            contextOf(node.location)));
    }
}

/// Warns about options that have no effect with the others of their action.
void adviseOnOptions(const Graph& graph, std::vector<std::string>& advice) {
    for (const Node& node : graph.nodes)
        for (const std::string& what : node.arguments.withoutEffect())
            advice.push_back(fmt::format("{}: {}", contextOf(node.location), what));
}

} // namespace

std::vector<std::string> adviceOn(const Graph& graph, bool alone) {
    std::vector<std::string> advice;
    adviseOnBirths(graph, advice);
    adviseOnFrozen(graph, advice);
    adviseOnOptions(graph, advice);
    if (alone) adviseOnUnused(graph, advice);
    return advice;
}

} // namespace curlew::app
