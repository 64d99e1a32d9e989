// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/language/Graph.h"

#include "Statement.h"
#include "curlew/app/registry/Text.h"
#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace curlew::app {

std::string contextOf(const SourceLocation& location) {
    const std::string& name = location.node.empty() ? location.action : location.node;
    const std::string shown = name == location.action ? "-" + name : fmt::format("-{} '{}'", location.action, name);
    return location.file.empty() ? shown : fmt::format("{}: {}", location.file, shown);
}

size_t Node::primaryOutput() const {
    if (outputs.empty()) throw ValueError(fmt::format("'{}' makes nothing that can be linked to", name));
    const auto always = [&](const Output& output) { return output.flag.empty() && output.amount.min > 0; };
    for (size_t k = outputs.size(); k-- > 0;)
        for (const Output& declared : action().makes)
            if (declared.name == outputs[k].name && always(declared)) return k;
    return outputs.size() - 1;
}

const Object& Graph::objectOf(const Link& link) const {
    static const Object points{.kind = Kind::points};
    switch (link.from) {
        case Link::From::node:
            return nodes.at(link.index).outputs.at(link.output);
        case Link::From::given:
            return given.at(link.index).object;
        case Link::From::state:
            break;
    }
    return points;
}

std::optional<size_t> Graph::find(std::string_view name) const {
    for (size_t k = 0; k < nodes.size(); ++k)
        if (nodes[k].name == name) return k;
    return {};
}

namespace {

/// Returns the output that "NAME.output" refers to, by name or by number.
size_t outputOf(const Node& node, const std::string& output) {
    std::vector<std::string> names;
    for (size_t k = 0; k < node.outputs.size(); ++k) {
        if (node.outputs[k].name == output) return k;
        names.push_back(node.outputs[k].name);
    }
    size_t number = 0;
    const auto [end, error] = std::from_chars(output.data(), output.data() + output.size(), number);
    if (error == std::errc() && end == output.data() + output.size() && number < node.outputs.size()) return number;
    throw ValueError(fmt::format("'{}' has no output '{}'{}; it has {}", node.name, output, didYouMean(output, names),
                                 names.empty() ? "none" : join(names, ", ")));
}

std::vector<std::string> allNames(const Graph& graph) {
    std::vector<std::string> names;
    for (const Node& node : graph.nodes)
        if (!node.outputs.empty()) names.push_back(node.name);
    for (const State& state : graph.states) names.push_back(state.name);
    for (const Given& given : graph.given)
        if (!given.name.empty()) names.push_back(given.name);
    return names;
}

} // namespace

Link linkOf(const Graph& graph, const std::string& name) {
    for (size_t k = graph.given.size(); k-- > 0;)
        if (!graph.find(name) && graph.given[k].name == name && !name.empty())
            return {.from = Link::From::given, .index = k};
    for (size_t k = 0; k < graph.states.size(); ++k)
        if (graph.states[k].name == name) return {.from = Link::From::state, .index = k};
    const size_t dot = graph.find(name) ? std::string::npos : name.rfind('.');
    const auto node = graph.find(name.substr(0, dot));
    if (!node) {
        const auto names = allNames(graph);
        throw ValueError(
            fmt::format("there is no '{}'{}; {}", name, didYouMean(name, names),
                        names.empty() ? "nothing has been made yet" : "the names are " + join(names, ", ")));
    }
    const Node& found = graph.nodes[*node];
    return {.index = *node,
            .output = dot == std::string::npos ? found.primaryOutput() : outputOf(found, name.substr(dot + 1))};
}

std::string nameOf(const Graph& graph, const Link& link) {
    if (link.from == Link::From::state) return graph.states.at(link.index).name;
    if (link.from == Link::From::given) return graph.given.at(link.index).name;
    const Node& node = graph.nodes.at(link.index);
    if (link.output == node.primaryOutput()) return node.name;
    const std::string& output = node.outputs.at(link.output).name;
    const auto same = std::count_if(node.outputs.begin(), node.outputs.end(),
                                    [&](const Object& object) { return object.name == output; });
    return fmt::format("{}.{}", node.name, same == 1 && !output.empty() ? output : std::to_string(link.output));
}

bool isNodeName(std::string_view name) {
    const auto good = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-'; };
    return !name.empty() && name != "none" && std::all_of(name.begin(), name.end(), good) &&
           std::isdigit(static_cast<unsigned char>(name.front())) == 0 && name.front() != '-';
}

std::string unusedName(const Graph& graph, const std::string& wanted) {
    bool used = false;
    std::vector<bool> numbers(graph.nodes.size() + graph.states.size() + graph.given.size() +
                              3); // wanted_2, wanted_3 …
    const auto note = [&](const std::string& name) {
        if (!name.starts_with(wanted)) return;
        used = used || name.size() == wanted.size();
        if (name.size() < wanted.size() + 2 || name[wanted.size()] != '_') return;
        if (const auto k = wholeNumber(std::string_view(name).substr(wanted.size() + 1)))
            if (static_cast<size_t>(*k) < numbers.size()) numbers[static_cast<size_t>(*k)] = true;
    };
    for (const Node& node : graph.nodes) note(node.name);
    for (const State& state : graph.states) note(state.name);
    for (const Given& given : graph.given) note(given.name);
    if (!used) return wanted;
    return fmt::format("{}_{}", wanted, std::find(numbers.begin() + 2, numbers.end(), false) - numbers.begin());
}

std::vector<Object> outputsOf(const Arguments& arguments, const std::vector<std::vector<Object>>& inputs,
                              const World& world) {
    const Action& action = arguments.action();
    if (action.makesWith) return action.makesWith(arguments, inputs, world);
    int dimension = inputs.empty() ? 3 : 0;
    for (const auto& objects : inputs)
        for (const Object& object : objects)
            if (accepts(Kind::field, object.kind) || object.kind == Kind::flow)
                dimension = std::max(dimension, object.dimension);
    std::vector<Object> objects;
    for (const Output& output : action.makes) {
        if (output.kinds.front() == Kind::report || output.kinds.front() == Kind::file) continue;
        if (!output.flag.empty() && !arguments.flag(output.flag)) continue;
        const Kind kind = output.kinds.front() == Kind::field ? Kind::noise : output.kinds.front();
        objects.push_back({.kind = kind, .dimension = dimension == 0 ? 3 : dimension, .name = output.name});
    }
    return objects;
}

bool fits(const std::vector<Kind>& kinds, const Object& object) {
    return accepts(kinds, object.kind) ||
           std::any_of(object.perhaps.begin(), object.perhaps.end(), [&](Kind kind) { return accepts(kinds, kind); });
}

std::string phraseOf(const std::vector<Kind>& kinds) {
    std::vector<std::string> names;
    for (const Kind kind : kinds) {
        switch (kind) {
            case Kind::field:
            case Kind::noise:
                names.emplace_back("a field");
                break;
            case Kind::levelSet:
                names.emplace_back("a level set");
                break;
            case Kind::velocity:
                names.emplace_back("a velocity grid");
                break;
            case Kind::image:
                names.emplace_back("an image");
                break;
            case Kind::points:
            case Kind::curves:
                names.emplace_back(nameOf(kind));
                break;
            default:
                names.push_back(fmt::format("a {}", nameOf(kind)));
        }
    }
    return join(names, " or ");
}

namespace {

/// The objects linked to a node.
class Linked : public Scope {
  public:
    Linked(const Graph& graph, const Node& node) {
        for (const auto& links : node.inputs)
            for (const Link& link : links) mObjects.push_back(graph.objectOf(link));
    }
    size_t count(const std::vector<Kind>& kinds) const override {
        return static_cast<size_t>(
            std::count_if(mObjects.begin(), mObjects.end(), [&](const Object& object) { return fits(kinds, object); }));
    }
    std::optional<Object> newest(const std::vector<Kind>& kinds) const override { return ofAge(kinds, 0); }
    std::optional<Object> second(const std::vector<Kind>& kinds) const override { return ofAge(kinds, 1); }
    bool linked() const override { return true; }

  private:
    std::optional<Object> ofAge(const std::vector<Kind>& kinds, size_t age) const {
        for (size_t k = mObjects.size(); k-- > 0;)
            if (fits(kinds, mObjects[k]) && age-- == 0) return mObjects[k];
        return {};
    }
    std::vector<Object> mObjects;
};

} // namespace

void validate(const Graph& graph, size_t index) {
    const Node& node = graph.nodes.at(index);
    const Linked linked(graph, node);
    for (size_t k = 0; k < node.inputs.size(); ++k) {
        const Input& input = node.action().takes[k];
        const auto& links = node.inputs[k];
        for (const Link& link : links) {
            const Object& object = graph.objectOf(link);
            if (fits(input.kinds, object)) continue;
            // A grid from a file is called by its name in the file.
            const bool named = link.from != Link::From::node || graph.nodes[link.index].named || object.name.empty();
            const bool grid = accepts(Kind::grid, object.kind);
            throw ValueError(fmt::format("{}= needs {}, but '{}' is {}", input.name, phraseOf(input.kinds),
                                         named || !grid ? nameOf(graph, link) : object.name, phraseOf({object.kind})));
        }
        const Amount amount = input.amountWith ? input.amountWith(node.arguments, linked) : input.amount;
        if (links.size() > amount.max)
            throw ValueError(amount.max == 0
                                 ? fmt::format("{}= has no effect here: {}", input.name, input.help)
                                 : fmt::format("{}= takes {}, not {}", input.name, amount.max, links.size()));
        if (links.size() < amount.min)
            throw ValueError(links.empty() ? fmt::format("nothing is connected to '{}': it needs {}", input.name,
                                                         phraseOf(input.kinds))
                                           : fmt::format("{}= needs {} objects, but there {} {}", input.name,
                                                         amount.min, links.size() == 1 ? "is" : "are", links.size()));
    }
}

} // namespace curlew::app
