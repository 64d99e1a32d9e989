// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/RayMesh.h"

#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <fmt/format.h>
#include <openvdb/math/Proximity.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace curlew {

namespace {

Box boundsOf(const std::vector<Vec3d>& vertices, const std::vector<Vec<uint32_t, 3>>& triangles) {
    if (triangles.empty()) throw ValueError("the mesh has no faces");
    Box box{vertices.at(triangles[0][0]), vertices.at(triangles[0][0])};
    for (const auto& triangle : triangles)
        for (const uint32_t k : triangle.c)
            for (int axis = 0; axis < 3; ++axis) {
                box.lower[axis] = std::min(box.lower[axis], vertices.at(k)[axis]);
                box.upper[axis] = std::max(box.upper[axis], vertices.at(k)[axis]);
            }
    if (!box.finite() || !(length(box.size()) > 0)) throw ValueError("the mesh has no extent");
    return box;
}

constexpr size_t kPacket = 8; // the width of AVX2

#if RTC_VERSION_MAJOR >= 4
void intersect(RTCScene scene, RTCRayHit& query) { rtcIntersect1(scene, &query); }
void intersect(RTCScene scene, const int* valid, RTCRayHit8& query) { rtcIntersect8(valid, scene, &query); }
void occlude(RTCScene scene, const int* valid, RTCRay8& rays) { rtcOccluded8(valid, scene, &rays); }
#else
RTCIntersectContext newContext(RTCIntersectContextFlags flags) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = flags;
    return context;
}
void intersect(RTCScene scene, RTCRayHit& query) {
    RTCIntersectContext context = newContext(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
    rtcIntersect1(scene, &context, &query);
}
void intersect(RTCScene scene, const int* valid, RTCRayHit8& query) {
    RTCIntersectContext context = newContext(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
    rtcIntersect8(valid, scene, &context, &query);
}
void occlude(RTCScene scene, const int* valid, RTCRay8& rays) {
    RTCIntersectContext context = newContext(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
    rtcOccluded8(valid, scene, &context, &rays);
}
#endif

/// Returns a ray in Embree's space.
RTCRay queryOf(const Vec3d& origin, const Vec3d& direction) {
    RTCRay ray{};
    ray.org_x = static_cast<float>(origin[0]);
    ray.org_y = static_cast<float>(origin[1]);
    ray.org_z = static_cast<float>(origin[2]);
    ray.dir_x = static_cast<float>(direction[0]);
    ray.dir_y = static_cast<float>(direction[1]);
    ray.dir_z = static_cast<float>(direction[2]);
    ray.tfar = std::numeric_limits<float>::infinity();
    ray.mask = ~0U;
    return ray;
}

/// Sets ray k of a packet.
void set(RTCRay8& packet, size_t k, const RTCRay& ray) {
    packet.org_x[k] = ray.org_x;
    packet.org_y[k] = ray.org_y;
    packet.org_z[k] = ray.org_z;
    packet.dir_x[k] = ray.dir_x;
    packet.dir_y[k] = ray.dir_y;
    packet.dir_z[k] = ray.dir_z;
    packet.tfar[k] = ray.tfar;
    packet.mask[k] = ray.mask;
}

/// Which rays of a packet exist: -1 or 0.
struct Valid {
    explicit Valid(size_t count) {
        for (size_t k = 0; k < count; ++k) lanes[k] = -1;
    }
    alignas(32) std::array<int, kPacket> lanes{};
};

} // namespace

struct RayMesh::Scene {
    Scene() : device(rtcNewDevice("isa=avx2")) {
        if (!device) throw ResourceError("Embree could not be started; there may be too little memory");
        scene = rtcNewScene(device);
    }
    ~Scene() {
        rtcReleaseScene(scene);
        rtcReleaseDevice(device);
    }
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;

    /// Builds the tree. Throws Interrupted once `cancelled` returns true, ResourceError if there is no memory for it.
    void commit(std::function<bool()> cancelled) const {
        const auto goesOn = [](void* asked, double) { return !(*static_cast<std::function<bool()>*>(asked))(); };
        if (cancelled) rtcSetSceneProgressMonitorFunction(scene, goesOn, &cancelled);
        rtcCommitScene(scene);
        rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);
        const RTCError error = rtcGetDeviceError(device);
        if (error == RTC_ERROR_CANCELLED) throw Interrupted();
        if (error != RTC_ERROR_NONE) throw ResourceError("Embree has no memory for this mesh");
    }

    RTCDevice device;
    RTCScene scene = nullptr;
};

RayMesh::RayMesh(std::vector<Vec3d> vertices, std::vector<Vec<uint32_t, 3>> triangles, const Monitor& monitor)
    : mVertices(std::move(vertices)),
      mTriangles(std::move(triangles)),
      mBox(boundsOf(mVertices, mTriangles)),
      mCenter(mBox.center()),
      mScale(1 / length(mBox.size())),
      mScene(std::make_unique<Scene>()) {
    auto* const geometry = rtcNewGeometry(mScene->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* const positions = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mVertices.size()));
    mTriangles.reserve(mTriangles.size() + 1); // Embree may read 16 bytes at the last triangle
    static_assert(sizeof(mTriangles[0]) == 3 * sizeof(uint32_t));
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mTriangles.data(), 0,
                               sizeof(mTriangles[0]), mTriangles.size());
    if (positions) {
        for (size_t k = 0; k < mVertices.size(); ++k)
            for (int axis = 0; axis < 3; ++axis)
                positions[3 * k + static_cast<size_t>(axis)] =
                    static_cast<float>((mVertices[k][axis] - mCenter[axis]) * mScale);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(mScene->scene, geometry);
    }
    rtcReleaseGeometry(geometry);
    // Compact: half the memory, and the pictures take no longer.
    rtcSetSceneFlags(mScene->scene, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT));
    rtcSetSceneBuildQuality(mScene->scene, RTC_BUILD_QUALITY_MEDIUM);
    mScene->commit(monitor.cancelled);
}

namespace {

std::vector<Vec3d> verticesOf(const Mesh& mesh) {
    constexpr double kBytesPerTriangle = 120; // vertices, triangles, normals and Embree's tree
    requireMemory(kBytesPerTriangle * static_cast<double>(mesh.triangles.size() + 2 * mesh.quads.size()),
                  fmt::format("the rays' tree of {} faces", mesh.faces()), "give a mesh with fewer faces");
    std::vector<Vec3d> vertices(mesh.points.size());
    for (size_t k = 0; k < vertices.size(); ++k)
        for (int axis = 0; axis < 3; ++axis) vertices[k][axis] = static_cast<double>(mesh.points[k][axis]);
    return vertices;
}

std::vector<Vec<uint32_t, 3>> trianglesOf(const Mesh& mesh) {
    std::vector<Vec<uint32_t, 3>> triangles;
    triangles.reserve(mesh.triangles.size() + 2 * mesh.quads.size() + 1);
    for (const auto& t : mesh.triangles) triangles.push_back({{t[0], t[1], t[2]}});
    for (const auto& q : mesh.quads) {
        triangles.push_back({{q[0], q[1], q[2]}});
        triangles.push_back({{q[0], q[2], q[3]}});
    }
    return triangles;
}

} // namespace

RayMesh::RayMesh(const Mesh& mesh, const Monitor& monitor) : RayMesh(verticesOf(mesh), trianglesOf(mesh), monitor) {}

RayMesh::~RayMesh() = default;

std::optional<RayMesh::Hit> RayMesh::hit(const Ray& ray) const {
    RTCRayHit query{};
    query.ray = queryOf((ray.origin - mCenter) * mScale, ray.direction);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    intersect(mScene->scene, query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    return refined(ray, query.hit.primID, query.ray.tfar, query.hit.u, query.hit.v);
}

void RayMesh::hits(std::span<const Ray> rays, std::span<std::optional<Hit>> found) const {
    for (size_t begin = 0; begin < rays.size(); begin += kPacket) {
        const size_t count = std::min(kPacket, rays.size() - begin);
        RTCRayHit8 query{};
        for (size_t k = 0; k < count; ++k) {
            const Ray& ray = rays[begin + k];
            set(query.ray, k, queryOf((ray.origin - mCenter) * mScale, ray.direction));
            query.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
        }
        intersect(mScene->scene, Valid(count).lanes.data(), query);
        for (size_t k = 0; k < count; ++k) {
            auto& hit = found[begin + k];
            hit.reset();
            if (query.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID)
                hit = refined(rays[begin + k], query.hit.primID[k], query.ray.tfar[k], query.hit.u[k], query.hit.v[k]);
        }
    }
}

void RayMesh::occluded(std::span<const Ray> rays, std::span<uint8_t> flags) const {
    for (size_t begin = 0; begin < rays.size(); begin += kPacket) {
        const size_t count = std::min(kPacket, rays.size() - begin);
        RTCRay8 query{};
        for (size_t k = 0; k < count; ++k)
            set(query, k, queryOf((rays[begin + k].origin - mCenter) * mScale, rays[begin + k].direction));
        occlude(mScene->scene, Valid(count).lanes.data(), query);
        for (size_t k = 0; k < count; ++k) flags[begin + k] = query.tfar[k] < 0 ? 1 : 0;
    }
}

RayMesh::Hit RayMesh::refined(const Ray& ray, uint32_t triangle, float distance, float u, float v) const {
    // Intersect the triangle's plane (Möller and Trumbore 1997).
    const auto& corners = mTriangles[triangle];
    const Vec3d a = mVertices[corners[0]], ab = mVertices[corners[1]] - a, ac = mVertices[corners[2]] - a;
    const Vec3d across = cross(ray.direction, ac), from = ray.origin - a;
    const double determinant = dot(ab, across);
    Hit hit{.distance = static_cast<double>(distance) / mScale, .triangle = triangle};
    hit.u = static_cast<double>(u), hit.v = static_cast<double>(v);
    // The triangle is seen edge-on.
    if (!(determinant * determinant > 1e-24 * dot(ab, ab) * dot(ac, ac))) return hit;
    const Vec3d beside = cross(from, ab);
    const double inverse = 1 / determinant, exact = dot(ac, beside) * inverse;
    if (!(std::abs(exact - hit.distance) * mScale < 1e-3)) return hit;
    hit.distance = exact;
    hit.u = std::clamp(dot(from, across) * inverse, 0.0, 1.0);
    hit.v = std::clamp(dot(ray.direction, beside) * inverse, 0.0, 1 - hit.u);
    return hit;
}

namespace {

openvdb::Vec3d asVdb(const Vec3d& p) { return {p[0], p[1], p[2]}; }

/// The search for the closest triangle. Embree calls visit() for triangles that may be closer than the query's radius.
struct ClosestTriangle {
    const RayMesh& mesh;
    openvdb::Vec3d position; ///< World units.
    double scale;            ///< From world units to Embree's.
    double best = std::numeric_limits<double>::infinity();

    static bool visit(RTCPointQueryFunctionArguments* arguments) {
        auto& search = *static_cast<ClosestTriangle*>(arguments->userPtr);
        const auto& corners = search.mesh.triangles()[arguments->primID];
        const auto corner = [&](int k) { return asVdb(search.mesh.vertices()[corners[k]]); };
        openvdb::Vec3d weights;
        const openvdb::Vec3d closest =
            openvdb::math::closestPointOnTriangleToPoint(corner(0), corner(1), corner(2), search.position, weights);
        const double distance = (closest - search.position).length();
        if (!(distance < search.best)) return false;
        search.best = distance;
        // Embree compares in float: leave a margin for its rounding.
        arguments->query->radius = static_cast<float>(distance * search.scale * (1 + 1e-5) + 1e-6);
        return true;
    }
};

} // namespace

double RayMesh::distanceTo(const Vec3d& position) const {
    ClosestTriangle search{.mesh = *this, .position = asVdb(position), .scale = mScale};
    const Vec3d local = (position - mCenter) * mScale;
    RTCPointQuery query{};
    query.x = static_cast<float>(local[0]);
    query.y = static_cast<float>(local[1]);
    query.z = static_cast<float>(local[2]);
    if (!std::isfinite(query.x) || !std::isfinite(query.y) || !std::isfinite(query.z)) return search.best;
    query.radius = std::numeric_limits<float>::infinity();
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(mScene->scene, &query, &context, ClosestTriangle::visit, &search);
    return search.best;
}

Vec3d RayMesh::normal(uint32_t triangle) const {
    const auto& corners = mTriangles[triangle];
    const Vec3d a = mVertices[corners[0]];
    const Vec3d area = cross(mVertices[corners[1]] - a, mVertices[corners[2]] - a);
    const double size = length(area);
    return size > 0 ? area * (1 / size) : Vec3d{};
}

} // namespace curlew
