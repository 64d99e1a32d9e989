// SPDX-License-Identifier: Apache-2.0
#include "Handle.h"
#include "Results.h"
#include "curlew/app/registry/Text.h"
#include "curlew/vdb/Openvdb.h"

using namespace curlew;
using namespace curlew::c;

namespace {

using Json = nlohmann::ordered_json;

std::vector<NamedArray> arraysOf(const app::Value& value) {
    if (const auto* mesh = std::get_if<app::MeshPointer>(&value)) return c::arraysOf(**mesh);
    if (const auto* points = std::get_if<app::PointsPointer>(&value))
        return (*points)->positionsN ? c::arraysOf(*(*points)->positionsN) : c::arraysOf((*points)->particles);
    if (const auto* curves = std::get_if<app::CurvesPointer>(&value)) return c::arraysOf(**curves);
    if (const auto* image = std::get_if<std::shared_ptr<const app::ImageValue>>(&value))
        return c::arraysOf((*image)->image);
    return {};
}

Json describe(const app::AnyFlow& any) {
    return std::visit(
        [](const auto& flow) -> Json {
            return {{"dimension", std::remove_cvref_t<decltype(flow)>::kDimension},
                    {"tracks", flow.hasTracks()},
                    {"divergence_free", flow.divergenceFree()},
                    {"lower", flow.domain().box.lower.c},
                    {"upper", flow.domain().box.upper.c}};
        },
        any);
}

Json describe(const openvdb::GridBase& grid) {
    const openvdb::Vec3d voxel = grid.voxelSize();
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    const bool empty = box.empty();
    const auto corner = [&](const openvdb::Coord& c, int more) {
        return empty ? std::array<int, 3>{0, 0, 0} : std::array<int, 3>{c[0] + more, c[1] + more, c[2] + more};
    };
    Json matrix = Json::array();
    if (grid.transform().isLinear()) {
        const openvdb::Mat4R m = grid.transform().baseMap()->getAffineMap()->getMat4();
        // OpenVDB's matrices multiply row vectors.
        for (int row = 0; row < 4; ++row) matrix.push_back({m(0, row), m(1, row), m(2, row), m(3, row)});
    }
    return {{"name", grid.getName()},
            {"type", grid.valueType()},
            {"value_type", grid.valueType()},
            {"class", openvdb::GridBase::gridClassToString(grid.getGridClass())},
            {"voxel_size", {voxel[0], voxel[1], voxel[2]}},
            {"active_voxels", grid.activeVoxelCount()},
            {"level_set", grid.getGridClass() == openvdb::GRID_LEVEL_SET},
            {"lower", corner(box.min(), 0)},
            {"upper", corner(box.max(), 1)},
            {"transform", matrix}};
}

Json describe(const app::Value& value) {
    Json about = Json::object();
    if (const auto* field = std::get_if<app::FieldValue>(&value))
        return {{"dimension", app::dimensionOf(field->field)}, {"program", field->program}};
    if (const auto* flow = std::get_if<app::AnyFlow>(&value)) return describe(*flow);
    if (const auto* grid = std::get_if<app::GridValue>(&value)) return describe(*grid->grid);
    if (const auto* image = std::get_if<std::shared_ptr<const app::ImageValue>>(&value))
        about = {{"width", (*image)->image.width},
                 {"height", (*image)->image.height},
                 {"channels", (*image)->image.channels}};
    constexpr std::array kTypes{"float32", "float64", "int32", "int64"};
    about["arrays"] = Json::object();
    for (const NamedArray& array : arraysOf(value))
        about["arrays"][array.name] = {{"type", kTypes.at(static_cast<size_t>(array.type()))},
                                       {"components", array.columns.size()},
                                       {"count", array.count}};
    return about;
}

/// Replaces invalid UTF-8.
std::string textOf(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

curlew_kind abiKindOf(const app::Value& value) {
    switch (app::kindOf(value)) {
        case app::Kind::flow:
            return CURLEW_FLOW;
        case app::Kind::mesh:
            return CURLEW_MESH;
        case app::Kind::points:
            return CURLEW_POINTS;
        case app::Kind::curves:
            return CURLEW_CURVES;
        case app::Kind::image:
            return CURLEW_IMAGE;
        case app::Kind::noise:
        case app::Kind::shape:
            return CURLEW_FIELD;
        default:
            return CURLEW_GRID;
    }
}

const char* nameOf(curlew_kind kind) {
    constexpr std::array kNames{"field", "flow", "grid", "mesh", "points", "curves", "image"};
    if (kind < 0 || static_cast<size_t>(kind) >= kNames.size())
        throw ValueError(fmt::format("there is no object kind {}", kind));
    return kNames[static_cast<size_t>(kind)];
}

} // namespace

size_t curlew_session::count(curlew_kind kind) const {
    nameOf(kind);
    const auto& all = readable().objects();
    return static_cast<size_t>(
        std::count_if(all.begin(), all.end(), [&](const auto& held) { return abiKindOf(held.value) == kind; }));
}

void curlew_session::forgetFound() {
    firstFound += static_cast<int64_t>(found.size());
    found.clear();
    foundAs.clear();
}

const app::Session::Held& curlew_session::object(curlew_kind kind, int64_t position) const {
    const std::string what = nameOf(kind);
    const auto& all = readable().objects();
    if (position < 0) throw ValueError(fmt::format("an age cannot be {}; the newest object has age 0", position));
    if (position >= kFound) {
        if (position < firstFound)
            throw ValueError(fmt::format("that {} was found in an earlier run or frame; find it again", what));
        const auto k = static_cast<size_t>(position - firstFound);
        if (k < found.size() && abiKindOf(found[k].value) == kind) return found[k];
        throw ValueError(fmt::format("no {} has been found at position {}", what, position));
    }
    int64_t age = position;
    for (size_t k = all.size(); k-- > 0;)
        if (abiKindOf(all[k].value) == kind && age-- == 0) return all[k];
    const size_t there = count(kind);
    throw ValueError(there == 0 ? fmt::format("there is no {} yet", what)
                                : fmt::format("there is no {} of age {}; there {} {}", what, position,
                                              there == 1 ? "is" : "are", there));
}

extern "C" {

curlew_status curlew_count(const curlew_session* session, curlew_kind kind, int64_t* count) {
    return guarded([&] {
        required(count, "the pointer to the count") = 0;
        *count = static_cast<int64_t>(required(session, "the session").count(kind));
    });
}

curlew_status curlew_find(const curlew_session* session, const char* name, curlew_kind* kind, int64_t* position) {
    return guarded([&] {
        const curlew_session& s = required(session, "the session");
        curlew_kind& foundKind = required(kind, "the pointer to the kind");
        int64_t& foundPosition = required(position, "the pointer to the position");
        const std::string wanted = &required(name, "the name");
        app::Session::Held held = s.readable().result(wanted);
        foundKind = abiKindOf(held.value);
        if (const auto known = s.foundAs.find(wanted); known != s.foundAs.end()) {
            foundPosition = known->second;
            return;
        }
        foundPosition = s.firstFound + static_cast<int64_t>(s.found.size());
        s.found.push_back(std::move(held));
        s.foundAs[wanted] = foundPosition;
    });
}

curlew_status curlew_evaluated(const curlew_session* session, const char** json) {
    return guarded([&] {
        required(json, "the pointer to the text") = nullptr;
        const curlew_session& s = required(session, "the session");
        s.text = textOf(Json(s.readable().evaluated()));
        *json = s.text.c_str();
    });
}

curlew_status curlew_describe(const curlew_session* session, curlew_kind kind, int64_t age, const char** json) {
    return guarded([&] {
        required(json, "the pointer to the text") = nullptr;
        const curlew_session& s = required(session, "the session");
        s.text = textOf(describe(s.object(kind, age).value));
        *json = s.text.c_str();
    });
}

curlew_status curlew_read(const curlew_session* session, curlew_kind kind, int64_t age, const char* array,
                          const curlew_buffer* buffer) {
    return guarded([&] {
        const std::string name = &required(array, "the name of the array");
        const auto arrays = arraysOf(required(session, "the session").object(kind, age).value);
        std::vector<std::string> names;
        for (const NamedArray& known : arrays) {
            if (known.name == name) return copy(known, required(buffer, "the buffer"));
            names.push_back(known.name);
        }
        throw ValueError(
            fmt::format("there is no array '{}'; there are {}", name, names.empty() ? "none" : app::join(names, ", ")));
    });
}

curlew_status curlew_report(const curlew_session* session, const char** json) {
    return guarded([&] {
        required(json, "the pointer to the text") = nullptr;
        const curlew_session& s = required(session, "the session");
        s.text = textOf(s.readable().report);
        *json = s.text.c_str();
    });
}
}
