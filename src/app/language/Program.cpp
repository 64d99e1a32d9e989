// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/language/Program.h"

#include "Builder.h"
#include "curlew/app/registry/InContext.h"

#include <algorithm>

namespace curlew::app {

namespace {

Graph built(const std::vector<Included>& parts, const Reading& reading) {
    Builder builder(reading);
    for (const Included& part : parts)
        if (part.statement)
            builder.add(*part.statement);
        else
            inContextOf(part.location.file, [&] { builder.add(graphOfJson(part.json, reading)); });
    return builder.finish();
}

/// Throws ValueError if a field conforms to a wall but no flow uses it.
void requireWallsUsed(const Graph& graph) {
    for (size_t k = 0; k < graph.nodes.size(); ++k) {
        const Node& node = graph.nodes[k];
        if (!node.action().conforms) continue;
        bool used = false, flowAfter = false;
        for (size_t j = k + 1; j < graph.nodes.size(); ++j) {
            flowAfter = flowAfter || graph.nodes[j].action().makesKind(Kind::flow);
            for (const auto& links : graph.nodes[j].inputs)
                for (const Link& link : links) used = used || (link.from == Link::From::node && link.index == k);
        }
        if (!used && flowAfter)
            throw ValueError(
                fmt::format("{}: nothing uses the bounded field, so no flow conforms to the wall; -dfvn has to take it "
                            "as one of its fields",
                            contextOf(node.location)));
    }
}

} // namespace

Graph graphOfCommandLine(const std::vector<std::string>& tokens, const Reading& reading) {
    Graph graph = built(statementsOf(tokens, reading), reading);
    requireWallsUsed(graph);
    return graph;
}

Graph graphOfScene(const std::string& text, const std::string& name, const Reading& reading) {
    return built(statementsOfScene(text, name, reading), reading);
}

Graph graphOfText(const std::string& text, const std::string& name, const Reading& reading) {
    const size_t first = text.find_first_not_of(" \t\r\n");
    return first != std::string::npos && text[first] == '{' ? graphOfJson(text, reading)
                                                            : graphOfScene(text, name, reading);
}

} // namespace curlew::app
