#include "Advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace curlew::app {

namespace {

bool isWall(const Object& object) { return object.kind == Kind::shape || object.kind == Kind::levelSet; }

/// Points that an action makes in each frame, and that one that advances moves: by one frame, and then they are gone.
void adviseOnBirths(const Graph& graph, std::vector<std::string>& advice) {
    for (size_t k = graph.frames; k < graph.nodes.size(); ++k)
        for (size_t i = 0; i < graph.nodes[k].inputs.size(); ++i)
            for (const Link& link : graph.nodes[k].inputs[i]) {
                const Node& node = graph.nodes[k];
                if (link.from != Link::From::node || !graph.inFrames(link.index)) continue;
                const Node& source = graph.nodes[link.index];
                if (source.action().inFrames != InFrames::once || !node.action().advances(node.arguments) ||
                    node.action().takes[i].use != Use::changed)
                    continue;
                advice.push_back(
                    fmt::format("{} after -frames makes its points anew in each frame, so -{} moves them for one frame "
                                "only: put it before -frames, or use -emit for points that are born as time goes by",
                                contextOf(source.location), node.action().name));
            }
}

void adviseOnUnused(const Graph& graph, std::vector<std::string>& advice) {
    std::set<size_t> used;
    for (const Node& node : graph.nodes)
        for (const auto& links : node.inputs)
            for (const Link& link : links)
                if (link.from == Link::From::node) used.insert(link.index);
    for (size_t k = 0; k < graph.nodes.size(); ++k) {
        const Node& node = graph.nodes[k];
        if (used.contains(k) || !std::any_of(node.outputs.begin(), node.outputs.end(), isWall)) continue;
        advice.push_back(fmt::format(
            "nothing uses {} that {} makes; for a flow to see it, give it to -bound (side=outside around "
            "an obstacle) before -dfvn",
            node.outputs.front().kind == Kind::shape ? "the shape" : "the level set", contextOf(node.location)));
    }
}

} // namespace

std::vector<std::string> adviceOn(const Graph& graph, bool alone) {
    std::vector<std::string> advice;
    adviseOnBirths(graph, advice);
    if (alone) adviseOnUnused(graph, advice);
    return advice;
}

} // namespace curlew::app
