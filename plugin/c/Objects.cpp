#include "Handle.h"
#include "Results.h"
#include "curlew/app/Text.h"

using namespace curlew;
using namespace curlew::c;

namespace {

using Json = nlohmann::ordered_json;

size_t ageOf(int64_t age) {
    if (age < 0) throw ValueError(fmt::format("an age cannot be {}; the newest is 0", age));
    return static_cast<size_t>(age);
}

/// The geometry of that kind and age, or null.
template <class T>
const T* geometryOf(const app::Session& s, size_t age) {
    for (size_t k = 0; k < s.geometry.size(); ++k)
        if (const auto* held = std::get_if<T>(&s.geometry.at(k)); held && age-- == 0) return held;
    return nullptr;
}

template <class T>
size_t countOf(const app::Session& s) {
    size_t count = 0;
    while (geometryOf<T>(s, count)) ++count;
    return count;
}

using MeshPointer = std::shared_ptr<const Mesh>;
using CurvesPointer = std::shared_ptr<const Curves>;

template <class T>
const T& requiredGeometry(const app::Session& s, int64_t age, const char* what) {
    if (const T* held = geometryOf<T>(s, ageOf(age))) return *held;
    throw ValueError(fmt::format("there are no {} of age {}; there are {}", what, age, countOf<T>(s)));
}

size_t countOf(const app::Session& s, curlew_kind kind) {
    switch (kind) {
        case CURLEW_FIELD:
            return s.fields.size();
        case CURLEW_FLOW:
            return s.flows.size();
        case CURLEW_GRID:
            return s.grids.size();
        case CURLEW_MESH:
            return countOf<MeshPointer>(s);
        case CURLEW_POINTS:
            return countOf<Particles>(s);
        case CURLEW_CURVES:
            return countOf<CurvesPointer>(s);
        case CURLEW_IMAGE:
            return s.images.size();
    }
    throw ValueError(fmt::format("there is no kind {} of objects", static_cast<int>(kind)));
}

std::vector<NamedArray> arraysAt(const app::Session& s, curlew_kind kind, int64_t age) {
    switch (kind) {
        case CURLEW_MESH:
            return arraysOf(*requiredGeometry<MeshPointer>(s, age, "meshes"));
        case CURLEW_POINTS:
            return arraysOf(requiredGeometry<Particles>(s, age, "points"));
        case CURLEW_CURVES:
            return arraysOf(*requiredGeometry<CurvesPointer>(s, age, "curves"));
        case CURLEW_IMAGE:
            return arraysOf(s.images.at(ageOf(age)).image);
        default:
            countOf(s, kind); // there is such a kind
            return {};
    }
}

Json describe(const app::FieldObject& object) {
    return {{"dimension", app::dimensionOf(object.field)}, {"program", object.program}};
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
    return {{"name", grid.getName()},
            {"type", grid.valueType()},
            {"class", openvdb::GridBase::gridClassToString(grid.getGridClass())},
            {"voxel_size", {voxel[0], voxel[1], voxel[2]}},
            {"active_voxels", grid.activeVoxelCount()},
            {"level_set", grid.getGridClass() == openvdb::GRID_LEVEL_SET}};
}

Json describe(const app::Session& s, curlew_kind kind, int64_t age) {
    Json about = Json::object();
    if (kind == CURLEW_FIELD) return describe(s.fields.at(ageOf(age)));
    if (kind == CURLEW_FLOW) return describe(s.flows.at(ageOf(age)));
    if (kind == CURLEW_GRID) return describe(*s.grids.at(ageOf(age)).grid);
    if (kind == CURLEW_IMAGE) {
        const Image& image = s.images.at(ageOf(age)).image;
        about = {{"width", image.width}, {"height", image.height}, {"channels", image.channels}};
    }
    constexpr std::array kTypes{"float32", "float64", "int32", "int64"};
    about["arrays"] = Json::object();
    for (const NamedArray& array : arraysAt(s, kind, age))
        about["arrays"][array.name] = {{"type", kTypes.at(static_cast<size_t>(array.type()))},
                                       {"components", array.columns.size()},
                                       {"count", array.count}};
    return about;
}

/// Text that is no UTF-8 becomes some.
std::string textOf(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

} // namespace

extern "C" {

curlew_status curlew_count(const curlew_session* session, curlew_kind kind, int64_t* count) {
    return guarded([&] {
        required(count, "the pointer to the count") = 0;
        *count = static_cast<int64_t>(countOf(required(session, "the session").readable(), kind));
    });
}

curlew_status curlew_describe(const curlew_session* session, curlew_kind kind, int64_t age, const char** json) {
    return guarded([&] {
        required(json, "the pointer to the text") = nullptr;
        const curlew_session& s = required(session, "the session");
        s.text = textOf(describe(s.readable(), kind, age));
        *json = s.text.c_str();
    });
}

curlew_status curlew_read(const curlew_session* session, curlew_kind kind, int64_t age, const char* array,
                          const curlew_buffer* buffer) {
    return guarded([&] {
        const std::string name = &required(array, "the name of the array");
        const auto arrays = arraysAt(required(session, "the session").readable(), kind, age);
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
