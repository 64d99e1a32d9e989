// SPDX-License-Identifier: Apache-2.0
#include "Builder.h"
#include "curlew/app/registry/Json.h"

namespace curlew::app {

namespace {

Json jsonOf(const Arguments& arguments) {
    Json json = Json::object();
    if (!arguments.writtenWords().empty()) json["words"] = arguments.writtenWords();
    for (const auto& [name, value] : arguments.written()) {
        const Option& option = *arguments.action().option(name);
        if (!option.selects && option.type != OptionType::ages) json["options"][name] = value;
    }
    return json;
}

} // namespace

std::string jsonOf(const Graph& graph) {
    Json json{{"curlew", kGraphVersion}, {"nodes", Json::array()}};
    for (size_t k = 0; k < graph.nodes.size(); ++k) {
        const Node& node = graph.nodes[k];
        Json one{{"name", node.name}, {"action", node.action().name}};
        one.update(jsonOf(node.arguments));
        for (size_t i = 0; i < node.inputs.size(); ++i)
            for (const Link& link : node.inputs[i])
                one["inputs"][node.action().takes[i].name].push_back(nameOf(graph, link));
        if (graph.frameRange && (!node.action().setting || graph.inFrames(k)))
            one["when"] = graph.inFrames(k) ? "frame" : "once";
        json["nodes"].push_back(std::move(one));
    }
    if (graph.frameRange) json["frames"] = jsonOf(*graph.frameRange);
    for (const State& state : graph.states) {
        Json one{{"name", state.name}};
        if (state.initial) one["initial"] = nameOf(graph, *state.initial);
        one["next"] = nameOf(graph, state.next);
        json["states"].push_back(std::move(one));
    }
    if (graph.resume) json["resume"] = true;
    if (!graph.effects) json["effects"] = false;
    if (!graph.wanted.empty()) json["wanted"] = graph.wanted;
    return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

} // namespace curlew::app
