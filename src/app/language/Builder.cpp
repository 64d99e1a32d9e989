// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: what an action takes from the stacks and what it leaves there follow one another.
#include "Builder.h"

#include "Missing.h"
#include "curlew/app/language/Frames.h"
#include "curlew/app/registry/InContext.h"
#include "curlew/app/registry/Text.h"

#include <algorithm>

namespace curlew::app {

namespace {

/// Returns the kinds that an option of type `ages` counts.
std::vector<Kind> countedBy(const std::string& option, const std::vector<Kind>& taken, bool several = false) {
    if (option == "field") return {Kind::field};
    if (option == "image" || option == "with") return {Kind::image};
    if (option != "geo" && accepts(taken, Kind::shape) && several) return taken; // several walls
    if (option != "geo") return {Kind::grid};
    if (taken == std::vector{Kind::points}) return taken;
    return {Kind::mesh, Kind::points, Kind::curves};
}

/// Returns whether options of type `ages` select the objects to write.
bool anyAges(const Arguments& arguments) {
    return std::ranges::any_of(arguments.action().options, [&](const Option& option) {
        return option.type == OptionType::ages && arguments.given(option.name);
    });
}

} // namespace

Builder::Builder(const Reading& reading) : mReading(reading) {
    mGraph.given = reading.given;
    for (size_t k = 0; k < reading.given.size(); ++k) {
        const Link link{.from = Link::From::given, .index = k};
        mEntries.push_back({.link = link, .object = reading.given[k].object, .made = mClock++});
        if (!reading.given[k].name.empty()) mNames[reading.given[k].name] = link;
    }
}

size_t Builder::count(const std::vector<Kind>& kinds) const {
    return static_cast<size_t>(
        std::count_if(mEntries.begin(), mEntries.end(), [&](const Entry& entry) { return fits(kinds, entry.object); }));
}

std::optional<Object> Builder::newest(const std::vector<Kind>& kinds) const { return ofAge(kinds, 0); }
std::optional<Object> Builder::second(const std::vector<Kind>& kinds) const { return ofAge(kinds, 1); }

std::optional<Object> Builder::ofAge(const std::vector<Kind>& kinds, size_t age) const {
    for (size_t k = mEntries.size(); k-- > 0;)
        if (fits(kinds, mEntries[k].object) && age-- == 0) return mEntries[k].object;
    return {};
}

World Builder::world() const {
    return {.contents = [this](const std::string& file) -> std::optional<std::vector<Object>> {
                if (const auto found = mWritten.find(file); found != mWritten.end()) return found->second;
                return mReading.world.contents ? mReading.world.contents(file) : std::nullopt;
            },
            .streamed = mReading.world.streamed,
            .lenient = mReading.world.lenient};
}

Link Builder::resolved(const std::string& name) const {
    // A changed object keeps its name. The node's other outputs are not affected.
    const auto found = mNames.find(name);
    return found == mNames.end() ? linkOf(mGraph, name) : found->second;
}

std::string Builder::nameFor(const Link& link) const {
    if (link.from == Link::From::node && link.output != mGraph.nodes[link.index].primaryOutput())
        return nameOf(mGraph, link);
    for (const auto& [name, target] : mNames)
        if (target == link) return name;
    return nameOf(mGraph, link);
}

// --- the inputs of an action

std::vector<Link> Builder::atAges(const std::string& option, const std::vector<size_t>& ages,
                                  const std::vector<Kind>& kinds) const {
    std::vector<Link> newestFirst, links;
    for (size_t k = mEntries.size(); k-- > 0;)
        if (fits(kinds, mEntries[k].object)) newestFirst.push_back(mEntries[k].link);
    const std::string kind = accepts(kinds, Kind::noise) ? "field" : kinds.size() > 1 ? "geometry" : nameOf(kinds[0]);
    for (const size_t age : ages) {
        if (age >= newestFirst.size())
            throw ValueError(newestFirst.empty()
                                 ? fmt::format("{}={}: there is no {} yet", option, age, kind)
                                 : fmt::format("{}={}: there is no {} of age {}; there {} {}", option, age, kind, age,
                                               newestFirst.size() == 1 ? "is" : "are", newestFirst.size()));
        links.push_back(newestFirst[age]);
    }
    return links;
}

/// Returns the newest objects that an input accepts; without `walls`, shapes that bound a field are left out.
std::vector<Link> Builder::newestOf(const Input& input, const Amount& amount, bool walls,
                                    std::vector<const Entry*>& used) const {
    std::vector<Link> links;
    const auto takeOf = [&](const std::vector<Kind>& kinds) {
        for (size_t k = mEntries.size(); k-- > 0 && links.size() < amount.max;) {
            const Entry& entry = mEntries[k];
            if (!fits(kinds, entry.object) || (input.accumulates && !entry.state) || (entry.object.isWall && !walls))
                continue;
            if (std::find(used.begin(), used.end(), &entry) != used.end()) continue;
            links.insert(links.begin(), entry.link);
            if (input.use == Use::taken) used.push_back(&entry);
        }
    };
    if (input.choose && amount.max > 0) {
        std::vector<const Entry*> fitting; // newest first
        std::vector<Object> objects;
        for (size_t k = mEntries.size(); k-- > 0;) {
            if (!fits(input.kinds, mEntries[k].object) || std::ranges::count(used, &mEntries[k]) > 0) continue;
            fitting.push_back(&mEntries[k]);
            objects.push_back(mEntries[k].object);
        }
        for (const size_t age : input.choose(objects)) {
            links.push_back(fitting[age]->link);
            if (input.use == Use::taken) used.push_back(fitting[age]);
        }
        if (!links.empty()) return links;
    }
    if (input.firstKindFirst) takeOf({input.kinds.front()});
    if (links.empty()) takeOf(input.kinds);
    if (links.size() < amount.min)
        throw ValueError(missing(input, amount.min, links.size(), count(input.kinds),
                                 count({Kind::grid}) > count({Kind::velocity})));
    return links;
}

/// Returns whether there are enough fields for all potentials of an action without the shapes that bound one.
bool Builder::enoughBesideWalls(const Statement& statement) const {
    size_t wanted = 0;
    for (const Input& input : statement.arguments.action().takes)
        if (input.potential)
            wanted += input.amountWith ? input.amountWith(statement.arguments, *this).max : input.amount.max;
    const auto fields = std::ranges::count_if(
        mEntries, [](const Entry& entry) { return fits({Kind::field}, entry.object) && !entry.object.isWall; });
    return static_cast<size_t>(fields) >= wanted;
}

std::vector<Link> Builder::chosen(const Input& input, const Statement& statement, bool walls,
                                  std::vector<const Entry*>& used) const {
    const Arguments& a = statement.arguments;
    std::vector<Link> links;
    if (const auto named = statement.inputs.find(input.name); named != statement.inputs.end()) {
        if (named->second != std::vector<std::string>{"none"})
            for (const auto& name : named->second)
                links.push_back(inContextOf(input.name + "=" + name, [&] { return resolved(name); }));
        return links;
    }
    if (input.namesWith) {
        for (const auto& name : input.namesWith(a)) links.push_back(resolved(name));
        return links;
    }
    const Amount amount = input.amountWith ? input.amountWith(a, *this) : input.amount;
    const bool aged = !input.age.empty() && a.given(input.age);
    if (amount.max == 0 && aged) throw ValueError(fmt::format("{}= has no effect here: {}", input.age, input.help));
    if (amount.max == 0) return {};
    const Option* ages = input.age.empty() ? nullptr : a.action().option(input.age);
    if (ages && (aged || (!ages->fallback.empty() && amount.min > 0))) {
        links = atAges(input.age, a.ages(input.age), countedBy(input.age, input.kinds, a.ages(input.age).size() > 1));
        if (links.size() > amount.max)
            throw ValueError(fmt::format("{}={} selects {} objects, but '{}' takes {}", input.age,
                                         a.written().at(input.age), links.size(), input.name, amount.max));
        for (const Entry& entry : mEntries)
            if (std::find(links.begin(), links.end(), entry.link) != links.end() && input.use == Use::taken)
                used.push_back(&entry);
        return links;
    }
    return newestOf(input, amount, walls || !input.potential, used);
}

std::vector<std::vector<Link>> Builder::inputsOf(const Statement& statement) const {
    const auto& takes = statement.arguments.action().takes;
    std::vector<std::vector<Link>> inputs(takes.size());
    std::vector<const Entry*> used;
    const auto shares = [&](const std::string& name) {
        return std::ranges::any_of(
            takes, [&](const Input& i) { return i.name == name && i.shares && i.shares(statement.arguments); });
    };
    for (const auto& [name, names] : statement.inputs) {
        if (names == std::vector<std::string>{"none"}) continue;
        for (const auto& one : names) {
            const Link link = inContextOf(fmt::format("{}={}", name, one), [&] { return resolved(one); });
            for (const Entry& entry : mEntries)
                if (entry.link == link && !shares(name)) used.push_back(&entry);
        }
    }
    const bool walls = !enoughBesideWalls(statement);
    for (size_t k = takes.size(); k-- > 0;) inputs[k] = chosen(takes[k], statement, walls, used);
    return inputs;
}

std::vector<std::vector<Link>> Builder::defaultInputs(const Arguments& arguments) const {
    const Statement statement{.arguments = arguments.at(mMoment)};
    if (!arguments.action().holds) return inputsOf(statement);
    std::vector<Link> links = written(statement, statement.arguments.words().front());
    for (const auto& file : statement.arguments.words())
        if (written(statement, file) != links)
            throw ValueError("the files of one action would hold different objects; use one action for each");
    return {std::move(links)};
}

// --- the effect of an action on the stacks

Link Builder::addState(std::optional<Link> initial, const std::string& name) {
    const Link link{.from = Link::From::state, .index = mGraph.states.size()};
    mGraph.states.push_back({.initial = initial, .next = link, .name = unusedName(mGraph, name)});
    mEntries.push_back({.link = link, .object = mGraph.objectOf(link), .made = mClock++, .state = link.index});
    return link;
}

void Builder::place(Node node, bool keep) {
    if (node.name.empty()) node.name = unusedName(mGraph, node.action().name);
    const auto& takes = node.action().takes;
    for (size_t k = 0; k < takes.size() && framed(); ++k)
        if (takes[k].accumulates && node.inputs[k].empty()) node.inputs[k] = {addState({}, node.name + "_before")};
    std::vector<std::vector<Object>> objects(node.inputs.size());
    for (size_t k = 0; k < node.inputs.size(); ++k)
        for (const Link& link : node.inputs[k]) objects[k].push_back(mGraph.objectOf(link));
    if (node.outputs.empty()) node.outputs = outputsOf(node.arguments.at(mMoment), objects, world());
    const size_t index = mGraph.nodes.size();
    const bool timeless = node.action().timeless(node.arguments);
    const bool makesField =
        std::ranges::any_of(node.outputs, [](const Object& made) { return accepts(Kind::field, made.kind); });
    for (size_t k = 0; k < takes.size() && makesField; ++k)
        for (Entry& entry : mEntries)
            if (takes[k].use == Use::stays && entry.object.kind == Kind::shape &&
                std::ranges::count(node.inputs[k], entry.link) > 0)
                entry.object.isWall = true;
    std::vector<size_t> replaced; // outputs that replace their inputs on the stacks
    for (size_t k = 0; k < takes.size() && !keep; ++k)
        for (const Link& link : node.inputs[k]) {
            for (const Entry& entry : mEntries)
                if (entry.link == link && takes[k].use != Use::stays) node.consumed.push_back(entry);
            if (takes[k].use == Use::taken)
                std::erase_if(mEntries, [&](const Entry& entry) { return entry.link == link; });
            if (takes[k].use != Use::changed) continue;
            for (size_t o = 0; o < node.outputs.size(); ++o) {
                if (!accepts(takes[k].kinds, node.outputs[o].kind)) continue;
                const Link changed{.index = index, .output = o};
                for (Entry& entry : mEntries)
                    if (entry.link == link) {
                        entry = {changed, node.outputs[o], entry.made, timeless ? std::nullopt : entry.state};
                        replaced.push_back(o);
                    }
                for (auto& [name, target] : mNames)
                    if (target == link) target = changed;
                break;
            }
        }
    for (size_t o = 0; o < node.outputs.size(); ++o)
        if (std::find(replaced.begin(), replaced.end(), o) == replaced.end())
            mEntries.push_back({.link = {.index = index, .output = o}, .object = node.outputs[o], .made = mClock++});
    for (size_t k = 0; k < takes.size() && timeless; ++k)
        for (Link& link : node.inputs[k])
            if (takes[k].use == Use::changed && link.from == Link::From::state)
                link = mGraph.states[link.index].initial.value_or(link); // each frame starts from the initial points
    const bool makes = !node.outputs.empty();
    if (node.named && makes) mNames[node.name] = {.index = index, .output = node.primaryOutput()};
    node.location.node = node.named ? node.name : "";
    mGraph.nodes.push_back(std::move(node));
    if (!framed()) mGraph.frames = mGraph.nodes.size();
    validate(mGraph, index);
    limitDepth(index);
}

/// Returns how deep the evaluation of a node nests calls, in units of the stack that a field takes. The operations of a
/// formula take about a tenth of it each. Counts them all, since most may be nested.
size_t ownDepth(const Node& node) {
    constexpr size_t kOperations = 10;
    size_t operations = 0;
    if (node.action().positional.formulas)
        for (const std::string& formula : node.arguments.words())
            operations += static_cast<size_t>(std::count_if(formula.begin(), formula.end(), [](char c) {
                return std::string_view("(+-*/^,").find(c) != std::string_view::npos;
            }));
    return 1 + operations / kOperations;
}

/// Throws ValueError if fields are nested so deeply that evaluating them could overflow the call stack.
void Builder::limitDepth(size_t node) {
    constexpr size_t kDeepest = 500;
    const std::vector<Kind> functions{Kind::field, Kind::flow};
    for (size_t k = mDepths.size(); k <= node; ++k) {
        const size_t own = ownDepth(mGraph.nodes[k]);
        mDepths.push_back(own);
        for (const auto& links : mGraph.nodes[k].inputs)
            for (const Link& link : links)
                if (link.from == Link::From::node && fits(functions, mGraph.objectOf(link)))
                    mDepths[k] = std::max(mDepths[k], mDepths[link.index] + own);
    }
    if (mDepths[node] > kDeepest)
        throw ValueError(fmt::format(
            "fields are nested more than {} deep; use fewer, or write a grid and continue with that", kDeepest));
}

void Builder::beginFrames(const Arguments& range, SourceLocation location, bool carry) {
    if (framed()) throw ValueError("is given twice; a program has only one");
    mGraph.frameRange = range;
    mGraph.frameLocation = std::move(location);
    mGraph.frames = mGraph.nodes.size();
    mMoment = framePlanOf(range.at({})).firstClock().moment();
    for (Entry& entry : mEntries) {
        if (!carry || entry.object.kind != Kind::points) continue;
        const Link initial = entry.link;
        const std::string name = initial.from == Link::From::node ? mGraph.nodes[initial.index].name : "points";
        entry.link = {.from = Link::From::state, .index = mGraph.states.size()};
        entry.state = mGraph.states.size();
        mGraph.states.push_back({.initial = initial, .next = entry.link, .name = unusedName(mGraph, name + "_before")});
        for (auto& [known, target] : mNames)
            if (target == initial) target = entry.link;
    }
    mOutside = mEntries;
}

// --- statements

void Builder::addNode(const Statement& statement) {
    const Arguments& a = statement.arguments;
    const Statement now{.arguments = a.at(mMoment), .inputs = statement.inputs};
    Node node{.arguments = a, .inputs = inputsOf(now), .location = statement.location};
    node.name = statement.as.empty() ? "" : statement.as;
    node.named = !statement.as.empty();
    for (Given& given : mGraph.given) // a new object may reuse the name of an older program's object
        if (node.named && given.name == node.name) given.name.clear();
    if (node.named && unusedName(mGraph, node.name) != node.name)
        throw ValueError(fmt::format("as={}: there is already a '{}'; choose another name", node.name, node.name));
    place(std::move(node), a.action().option("keep") && now.arguments.flag("keep"));
}

std::vector<Link> Builder::written(const Statement& statement, const std::string& file) const {
    const Arguments& a = statement.arguments;
    const std::vector<Kind> able = a.action().holds(a, file);
    if (able.empty()) return {};
    const Input& what = a.action().takes.front();
    std::vector<Link> links;
    if (const auto named = statement.inputs.find(what.name); named != statement.inputs.end()) {
        for (const auto& name : named->second) links.push_back(resolved(name));
    } else if (anyAges(a)) {
        for (const char* option : {"grid", "geo", "image"}) {
            if (!a.given(option)) continue;
            std::vector<Kind> held; // ages count only geometry that the file can hold
            for (const Kind kind : able)
                if (accepts(countedBy(option, {}), kind)) held.push_back(kind);
            if (held.empty()) continue;
            const auto chosen = atAges(option, a.ages(option), held);
            links.insert(links.end(), chosen.begin(), chosen.end());
        }
    }
    if (links.empty()) {
        Input newestHeld = what;
        newestHeld.kinds = able;
        std::vector<const Entry*> used;
        links = inContextOf(file, [&] { return newestOf(newestHeld, {1, 1}, true, used); });
    }
    return links;
}

/// Adds one node per selection of objects, since the files of a statement may hold different ones.
void Builder::addWriter(const Statement& statement) {
    const Statement now{.arguments = statement.arguments.at(mMoment), .inputs = statement.inputs};
    const auto& words = statement.arguments.writtenWords();
    std::vector<std::pair<std::vector<Link>, std::vector<std::string>>> groups;
    for (size_t k = 0; k < words.size(); ++k) {
        std::vector<Link> links = written(now, now.arguments.words()[k]);
        auto& contents = mWritten[now.arguments.words()[k]];
        contents.clear();
        for (const Link& link : links) contents.push_back(mGraph.objectOf(link));
        auto group = std::ranges::find(groups, links, &std::pair<std::vector<Link>, std::vector<std::string>>::first);
        if (group == groups.end())
            group = groups.emplace(group, std::move(links), std::vector<std::string>()); // files of the same objects
        group->second.push_back(words[k]);
    }
    for (auto& [links, files] : groups) {
        Arguments a(statement.arguments.action());
        for (const auto& file : files) a.addWord(file);
        for (const auto& [name, value] : statement.arguments.written()) a.set(name, value);
        place({.arguments = std::move(a), .inputs = {links}, .location = statement.location}, true);
    }
}

void Builder::add(const Statement& statement) {
    const Action& action = statement.arguments.action();
    inContextOf(contextOf(statement.location), [&] {
        if (mReading.location) *mReading.location = statement.location;
        if (action.name == "frames")
            beginFrames(statement.arguments, statement.location);
        else if (action.name == "resume")
            mGraph.resume = true;
        else if (action.holds)
            addWriter(statement);
        else
            addNode(statement);
    });
}

void Builder::add(Graph graph) {
    const bool onlySettings =
        std::all_of(mGraph.nodes.begin(), mGraph.nodes.end(), [](const Node& node) { return node.action().setting; });
    if (!onlySettings || framed() || !mGraph.given.empty())
        throw ValueError("a graph has to come first; only settings (-quiet, -threads, …) may stand before it");
    const size_t before = mGraph.nodes.size();
    for (Node& node : graph.nodes)
        for (auto& links : node.inputs)
            for (Link& link : links)
                if (link.from == Link::From::node) link.index += before;
    const auto shift = [&](Link& link) {
        if (link.from == Link::From::node) link.index += before;
    };
    for (State& state : graph.states) {
        shift(state.next);
        if (state.initial) shift(*state.initial);
    }
    for (auto* entries : {&graph.left, &graph.leftInFrame})
        for (Entry& entry : *entries) shift(entry.link);
    graph.nodes.insert(graph.nodes.begin(), mGraph.nodes.begin(), mGraph.nodes.end());
    mDepths.clear();
    graph.frames += before;
    mGraph = std::move(graph);
    mEntries = framed() ? mGraph.leftInFrame : mGraph.left;
    mOutside = mGraph.left;
    for (const Entry& entry : mEntries) mClock = std::max(mClock, entry.made + 1);
    for (size_t k = 0; k < mGraph.nodes.size(); ++k)
        if (const Node& node = mGraph.nodes[k]; !node.outputs.empty())
            mNames[node.name] = {.index = k, .output = node.primaryOutput()};
    if (framed()) mMoment = framePlanOf(mGraph.frameRange->at({})).firstClock().moment();
}

Graph Builder::finish() {
    if (!framed()) {
        mGraph.left = mEntries;
        return std::move(mGraph);
    }
    mGraph.leftInFrame = mEntries;
    for (const Entry& entry : mEntries)
        if (entry.state) {
            mGraph.states.at(*entry.state).next = entry.link;
            mGraph.left.push_back({.link = {.from = Link::From::state, .index = *entry.state},
                                   .object = entry.object,
                                   .made = entry.made});
        }
    for (const Entry& entry : mOutside) {
        // Points that are no longer carried from frame to frame: what they have become, or else the points themselves.
        const auto now = std::find_if(mEntries.begin(), mEntries.end(),
                                      [&](const Entry& other) { return other.made == entry.made; });
        if (!entry.state || now == mEntries.end())
            mGraph.left.push_back(entry);
        else if (!now->state)
            mGraph.left.push_back(*now);
    }
    std::sort(mGraph.left.begin(), mGraph.left.end(), [](const Entry& a, const Entry& b) { return a.made < b.made; });
    return std::move(mGraph);
}

} // namespace curlew::app
