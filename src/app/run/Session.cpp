// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/run/Session.h"

#include "Evaluator.h"
#include "SdfCache.h"
#include "curlew/app/registry/Text.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/VdbFile.h"

namespace curlew::app {

Kind kindOf(const Value& value) {
    struct KindOf {
        Kind operator()(std::monostate) const { return Kind::file; }
        Kind operator()(const FieldValue& field) const { return field.sdf ? Kind::shape : Kind::noise; }
        Kind operator()(const AnyFlow&) const { return Kind::flow; }
        Kind operator()(const GridValue& grid) const {
            if (grid.grid->getGridClass() == openvdb::GRID_LEVEL_SET) return Kind::levelSet;
            const bool vectors = grid.grid->isType<openvdb::Vec3SGrid>() || grid.grid->isType<openvdb::Vec3DGrid>();
            return vectors ? Kind::velocity : Kind::grid;
        }
        Kind operator()(const MeshPointer&) const { return Kind::mesh; }
        Kind operator()(const PointsPointer&) const { return Kind::points; }
        Kind operator()(const CurvesPointer&) const { return Kind::curves; }
        Kind operator()(const std::shared_ptr<const ImageValue>&) const { return Kind::image; }
    };
    return std::visit(KindOf(), value);
}

Session::Session(Console& output, bool keeps) : console(output), mKeeps(keeps), mSdfs(std::make_unique<SdfCache>()) {}
Session::~Session() = default;

void Session::run(Graph graph) {
    mGiven = std::move(mObjects);
    mObjects.clear();
    if (graph.given.size() > mGiven.size()) throw std::logic_error("a graph of another session");
    mGraph = std::move(graph);
    mEvaluated.clear();
    mEvaluator = std::make_unique<Evaluator>(*this, mGraph); // kept after the run, since it evaluates flows in time
    for (auto& [key, kept] : mKept) kept.used = false;
    mEvaluator->run();
    std::erase_if(mKept, [](const auto& one) { return !one.second.used; });
}

void Session::clear() {
    mObjects.clear();
    report = Json::object();
}

Session::Held Session::result(const std::string& name) const {
    const Link link = linkOf(mGraph, name);
    if (link.from == Link::From::given) return mGiven.at(link.index);
    if (link.from == Link::From::state) throw ValueError(fmt::format("'{}' is a state, not a result", name));
    const ResultPointer& result = mResults.at(link.index);
    if (!result || link.output >= result->outputs.size()) throw ValueError(fmt::format("'{}' has not been made", name));
    return {.object = mGraph.objectOf(link), .value = result->outputs[link.output], .name = name, .key = result->key};
}

World Session::world() const {
    return {
        .contents = [this](const std::string& file) -> std::optional<std::vector<Object>> {
            const auto found = mProvided.find(file);
            if (found == mProvided.end()) return {};
            Object object{.kind = kindOf(found->second.value)};
            if (const auto* field = std::get_if<FieldValue>(&found->second.value))
                object.dimension = dimensionOf(field->field);
            return std::vector{object};
        },
        .streamed = [this](const std::string& stream, const std::string& ending) { return streamed(stream, ending); }};
}

const std::filesystem::path& Session::streamed(const std::string& stream, const std::string& ending) const {
    return mStreams.try_emplace(stream, stream, ending, console.cancelFunction()).first->second.path();
}

std::vector<Given> Session::given() const {
    std::vector<Given> given;
    for (const Held& held : mObjects) given.push_back({held.object, held.name});
    return given;
}

void Session::provide(const std::string& name, Value value, const Digest& content) {
    mProvided.insert_or_assign(name, Provided{std::move(value), content});
}

} // namespace curlew::app
