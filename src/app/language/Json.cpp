// SPDX-License-Identifier: Apache-2.0
#include "Builder.h"
#include "JsonValues.h"
#include "curlew/app/language/Frames.h"
#include "curlew/app/registry/InContext.h"
#include "curlew/app/registry/Registry.h"
#include "curlew/app/registry/Text.h"

#include <algorithm>
#include <set>
#include <utility>

namespace curlew::app {

namespace {

constexpr size_t kMaxNodes = 100'000;
constexpr int kDeepest = 16;

Arguments argumentsOf(const Action& action, const Json& object) {
    Arguments arguments(action);
    for (const auto& word : textsOf(object, "words")) arguments.addWord(word);
    const Json options = memberOf(object, "options", Json::object());
    if (!options.is_object()) throw ValueError("'options' must be an object");
    for (const auto& [name, value] : options.items()) {
        const Option* option = action.option(name);
        if (option && (option->selects || option->type == OptionType::ages))
            throw ValueError(
                fmt::format("option '{}' selects from the stacks of a scene; a graph has links instead", name));
        arguments.set(name, textOf(value));
    }
    arguments.finish();
    return arguments;
}

/// A node of the document.
struct Record {
    Arguments arguments;
    std::string name;
    std::vector<std::vector<std::string>> inputs = {}; ///< Names of objects, by declared input.
    std::string when = {};                             ///< "", "once" or "frame"
    std::string origin = {};                           ///< If the node is a copy, the name of the original.
    bool inFrames = false;
};

class Document {
  public:
    Document(const std::string& text, const Reading& reading) : mReading(reading) {
        try {
            mJson = Json::parse(text, [](int depth, Json::parse_event_t, Json&) {
                if (depth > kDeepest)
                    throw ValueError(fmt::format("the graph is nested more than {} levels deep", kDeepest));
                return true;
            });
        } catch (const Json::exception& error) {
            throw ValueError(fmt::format("this is not a graph in JSON: {}", error.what()));
        }
        requireKeys(mJson, {"curlew", "nodes", "frames", "states", "moment", "resume", "wanted", "effects"},
                    "the graph");
        if (const Json version = memberOf(mJson, "curlew", kGraphVersion); version != kGraphVersion)
            throw ValueError(fmt::format("the graph has version {}, but this program reads version {}", version.dump(),
                                         kGraphVersion));
    }

    Graph graph() {
        readNodes();
        readStates();
        const Json range = memberOf(mJson, "frames", nullptr);
        mFramed = !range.is_null();
        if (mFramed)
            requireKeys(range, {"words", "options"}, "'frames'");
        else if (!mStates.empty())
            throw ValueError("'states' persist from frame to frame, but the graph has no 'frames'");
        classify();
        Builder builder(mReading);
        if (mFramed) splitAtFrames();
        std::optional<Moment> still;
        if (const Json moment = memberOf(mJson, "moment", nullptr); !moment.is_null())
            freeze(still.emplace(momentOf(moment)));
        const std::vector<size_t> order = sorted();
        for (const size_t k : order)
            if (!mRecords[k].inFrames) place(builder, mRecords[k]);
        if (mFramed) {
            const Action& frames = findAction(mReading.registry, "frames");
            inContextOf("frames", [&] {
                builder.beginFrames(argumentsOf(frames, range), {.action = "frames", .node = "frames"}, false);
            });
            addStates(builder);
            for (const size_t k : order)
                if (mRecords[k].inFrames) place(builder, mRecords[k]);
        }
        Graph graph = builder.finish();
        for (size_t k = 0; k < mStates.size(); ++k)
            if (!mStates[k].next.empty()) graph.states.at(k).next = linkOf(graph, mStates[k].next);
        graph.moment = still.value_or(Moment{});
        graph.resume = flagOf(mJson, "resume", false);
        graph.effects = flagOf(mJson, "effects", true);
        graph.wanted = textsOf(mJson, "wanted");
        for (const auto& name : graph.wanted) linkOf(graph, name);
        return graph;
    }

  private:
    struct StateRecord {
        std::string name, initial, next;
    };

    static Moment momentOf(const Json& object) {
        requireKeys(object, {"frame", "time", "fps"}, "'moment'");
        const auto number = [&](const char* name, double otherwise) {
            const Json value = memberOf(object, name, otherwise);
            if (!value.is_number()) throw ValueError(fmt::format("'{}' of the moment must be a number", name));
            return value.get<double>();
        };
        return {.frame = number("frame", 1), .time = number("time", 0), .fps = number("fps", 24)};
    }

    /// Runs `work` for a record. Messages of exceptions name the node, and the location is that of the node then.
    template <class Work>
    void at(const std::string& action, const std::string& name, const Work& work) const {
        const SourceLocation location{.action = action, .node = name};
        SourceLocation outer;
        if (mReading.location) outer = std::exchange(*mReading.location, location);
        inContextOf(contextOf(location), work);
        if (mReading.location) *mReading.location = std::move(outer);
    }

    static const std::string& shownName(const Record& record) {
        return record.origin.empty() ? record.name : record.origin;
    }

    void readNodes() {
        const Json nodes = memberOf(mJson, "nodes", Json::array());
        if (!nodes.is_array() || nodes.size() > kMaxNodes)
            throw ValueError(fmt::format("'nodes' must be a list of at most {} nodes", kMaxNodes));
        for (const Json& node : nodes) {
            requireKeys(node, {"name", "action", "words", "options", "inputs", "when"}, "a node");
            const std::string action = textOf(memberOf(node, "action", "")),
                              name = textOf(memberOf(node, "name", action));
            at(action, name, [&] { readNode(node, findAction(mReading.registry, action), name); });
        }
    }

    void readNode(const Json& node, const Action& action, const std::string& name) {
        if (name.empty()) throw ValueError("a node has no name");
        if (!mIndices.emplace(name, mRecords.size()).second)
            throw ValueError(fmt::format("two nodes have the name '{}'", name));
        if (action.name == "frames" || action.name == "config" || action.name == "set" || action.name == "resume")
            throw ValueError(R"(is not a node: a graph has "frames" and "resume" beside its nodes)");
        Record record{.arguments = argumentsOf(action, node), .name = name, .when = textOf(memberOf(node, "when", ""))};
        if (!record.when.empty() && record.when != "once" && record.when != "frame")
            throw ValueError(fmt::format("\"when\" is '{}'; it must be once or frame", record.when));
        record.inputs.resize(action.takes.size());
        const Json inputs = memberOf(node, "inputs", Json::object());
        if (!inputs.is_object()) throw ValueError("'inputs' must be an object");
        for (const auto& [input, names] : inputs.items()) {
            if (!action.input(input)) {
                std::vector<std::string> known;
                for (const Input& one : action.takes) known.push_back(one.name);
                throw ValueError(fmt::format("has no input '{}'{}; its inputs are {}", input, didYouMean(input, known),
                                             known.empty() ? "none" : join(known, ", ")));
            }
            record.inputs[action.inputIndex(input)] = textsOf(inputs, input.c_str());
        }
        mRecords.push_back(std::move(record));
    }

    void readStates() {
        const Json states = memberOf(mJson, "states", Json::array());
        if (!states.is_array()) throw ValueError("'states' must be a list");
        for (const Json& state : states) {
            requireKeys(state, {"name", "initial", "next"}, "a state");
            mStates.push_back({.name = textOf(memberOf(state, "name", "")),
                               .initial = textOf(memberOf(state, "initial", "")),
                               .next = textOf(memberOf(state, "next", ""))});
        }
    }

    bool isState(const std::string& name) const {
        return std::any_of(mStates.begin(), mStates.end(),
                           [&](const StateRecord& state) { return state.name == name; });
    }

    /// Returns the record that a link refers to; nullopt for a state or a given object.
    std::optional<size_t> recordOf(const std::string& link) const {
        auto found = mIndices.find(link);
        if (found == mIndices.end()) found = mIndices.find(link.substr(0, link.rfind('.')));
        if (found != mIndices.end()) return found->second;
        if (isState(link) || std::any_of(mReading.given.begin(), mReading.given.end(),
                                         [&](const Given& given) { return given.name == link; }))
            return {};
        std::vector<std::string> names;
        for (const auto& [name, index] : mIndices) names.push_back(name);
        throw ValueError(fmt::format("is linked to '{}', which does not exist{}", link, didYouMean(link, names)));
    }

    /// Calls `visit` with the records that a record is linked to.
    template <class Visit>
    void forEachSource(const Record& record, const Visit& visit) const {
        for (const auto& names : record.inputs)
            for (const auto& name : names)
                if (const auto source = recordOf(name)) visit(*source);
    }

    /// Returns the records in topological order, otherwise in the document's order, with settings first.
    std::vector<size_t> sorted() const {
        enum class Mark { none, open, done };
        struct Visit {
            size_t record;
            std::vector<size_t> sources;
            size_t next = 0; ///< The next source to visit.
        };
        std::vector<Mark> marks(mRecords.size(), Mark::none);
        std::vector<size_t> order;
        std::vector<Visit> open; // each is a source of the one before it
        const auto enter = [&](size_t k) {
            if (marks[k] == Mark::done) return;
            at(mRecords[k].arguments.action().name, mRecords[k].name, [&] {
                if (marks[k] == Mark::open) throw ValueError("the links form a cycle");
                marks[k] = Mark::open;
                Visit& visit = open.emplace_back(Visit{k, {}});
                forEachSource(mRecords[k], [&](size_t source) { visit.sources.push_back(source); });
            });
        };
        const auto visit = [&](size_t root) {
            enter(root);
            while (!open.empty()) {
                Visit& last = open.back();
                if (last.next < last.sources.size()) {
                    enter(last.sources[last.next++]);
                    continue;
                }
                marks[last.record] = Mark::done;
                order.push_back(last.record);
                open.pop_back();
            }
        };
        for (const bool settings : {true, false})
            for (size_t k = 0; k < mRecords.size(); ++k)
                if (mRecords[k].arguments.action().setting == settings) visit(k);
        return order;
    }

    /// Decides which nodes are evaluated in each frame.
    void classify() {
        if (!mFramed) return;
        for (const size_t k : sorted()) {
            Record& record = mRecords[k];
            const Action& action = record.arguments.action();
            if (record.when == "once") continue;
            if (action.setting) {
                record.inFrames = record.when == "frame";
                continue;
            }
            bool varies =
                record.when == "frame" || action.advances(record.arguments) || action.changes(record.arguments);
            if (action.inFrames != InFrames::once)
                forEachSource(record, [&](size_t source) { varies = varies || mRecords[source].inFrames; });
            for (const auto& names : record.inputs)
                for (const auto& name : names) varies = varies || isState(name);
            record.inFrames = varies;
        }
    }

    /// Nodes that are evaluated once but depend on nodes that change get copies of those, frozen in the starting frame.
    void splitAtFrames() {
        const Action& frames = findAction(mReading.registry, "frames");
        const Moment first = inContextOf(
            "frames", [&] { return framePlanOf(argumentsOf(frames, mJson["frames"]).at({})).startClock().moment(); });
        std::map<size_t, std::string> copies;
        const auto copyOf = [&](auto& self, size_t k) -> std::string {
            if (!mRecords[k].inFrames) return mRecords[k].name;
            if (const auto known = copies.find(k); known != copies.end()) return known->second;
            Record copy = mRecords[k];
            at(copy.arguments.action().name, copy.name, [&] {
                if (copy.arguments.action().advances(copy.arguments))
                    throw ValueError("advances with the frames, so nothing before them can use it");
            });
            copy.origin = copy.name;
            copy.name += "_first";
            while (mIndices.contains(copy.name)) copy.name += "_";
            copy.arguments = frozen(copy.arguments, first);
            copy.inFrames = false;
            for (auto& names : copy.inputs)
                for (auto& name : names) rename(name, self);
            mIndices[copy.name] = mRecords.size();
            copies[k] = copy.name;
            mRecords.push_back(std::move(copy));
            return copies[k];
        };
        const size_t count = mRecords.size(); // copies are appended, with their links
        for (size_t k = 0; k < count; ++k) {
            if (mRecords[k].inFrames) continue;
            auto inputs = mRecords[k].inputs;
            for (auto& names : inputs)
                for (auto& name : names) rename(name, copyOf);
            mRecords[k].inputs = std::move(inputs);
        }
    }

    template <class CopyOf>
    void rename(std::string& link, const CopyOf& copyOf) const {
        const auto source = recordOf(link);
        if (!source) return;
        const std::string output = mIndices.contains(link) ? "" : link.substr(link.rfind('.'));
        link = copyOf(copyOf, *source) + output;
    }

    /// Returns the arguments at a moment, with their expressions evaluated, except those with P.
    static Arguments frozen(const Arguments& arguments, const Moment& moment) {
        arguments.at(moment); // throws, naming the option, if a value is invalid then
        const auto at = [&](const std::string& text) {
            if (const Variables variables = variablesOf(text); variables.part) {
                if (variables.time)
                    throw ValueError(
                        fmt::format("'{}' has both the time and the part of the points, which a graph of one "
                                    "moment cannot have; leave one of them out",
                                    text));
                return text;
            }
            return escaped(expanded(text, moment));
        };
        Arguments still(arguments.action());
        for (const auto& word : arguments.writtenWords()) still.addWord(at(word));
        for (const auto& [name, value] : arguments.written()) still.set(name, at(value));
        return still;
    }

    /// Freezes everything that changes with time at one moment.
    void freeze(const Moment& moment) {
        if (mFramed) throw ValueError("'moment' is for a graph without frames");
        for (Record& record : mRecords)
            at(record.arguments.action().name, shownName(record),
               [&] { record.arguments = frozen(record.arguments, moment); });
    }

    void addStates(Builder& builder) {
        for (const StateRecord& state : mStates) {
            std::optional<Link> initial;
            if (!state.initial.empty()) initial = linkOf(builder.graph(), state.initial);
            builder.addState(initial, state.name);
        }
    }

    void place(Builder& builder, const Record& record) {
        at(record.arguments.action().name, shownName(record), [&] {
            const Action& action = record.arguments.action();
            Node node{.arguments = record.arguments,
                      .inputs = std::vector<std::vector<Link>>(record.inputs.size()),
                      .name = record.name,
                      .named = true,
                      .location = {.action = action.name, .node = shownName(record)}};
            for (size_t k = 0; k < record.inputs.size(); ++k)
                for (const auto& name : record.inputs[k]) {
                    Link link = linkOf(builder.graph(), name);
                    const bool advances = record.inFrames && !action.timeless(record.arguments);
                    if (action.takes[k].use == Use::changed && advances) link = advanced(builder, link, record);
                    node.inputs[k].push_back(link);
                }
            for (const auto& file : action.holds ? record.arguments.words() : std::vector<std::string>{})
                for (const auto& links : node.inputs)
                    for (const Link& link : links)
                        if (const Object& object = builder.graph().objectOf(link);
                            !fits(action.holds(record.arguments, file), object))
                            throw ValueError(fmt::format("'{}' cannot hold '{}', which is {}", file,
                                                         nameOf(builder.graph(), link), nameOf(object.kind)));
            builder.place(std::move(node), false);
        });
    }

    /// Points that were made before the frames continue, in each frame, from where the previous frame left them.
    Link advanced(Builder& builder, const Link& link, const Record& record) {
        if (link.from == Link::From::node && builder.graph().inFrames(link.index)) {
            if (builder.graph().objectOf(link).kind == Kind::points && !mChanged.insert(link).second)
                throw ValueError(
                    fmt::format("two nodes change the points of '{}', but the next frame can continue from only one of "
                                "them; give each node its own points",
                                nameOf(builder.graph(), link)));
            return link;
        }
        if (link.from == Link::From::state || builder.graph().objectOf(link).kind != Kind::points) return link;
        return builder.addState(link, record.name + "_before");
    }

    const Reading& mReading;
    Json mJson;
    std::vector<Record> mRecords;
    std::map<std::string, size_t> mIndices;
    std::vector<StateRecord> mStates;
    std::set<Link> mChanged;
    bool mFramed = false;
};

} // namespace

Graph graphOfJson(const std::string& text, const Reading& reading) { return Document(text, reading).graph(); }

} // namespace curlew::app
