// SPDX-License-Identifier: Apache-2.0
#include "RayMesh.h"

#include "curlew/base/Error.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

Box boundsOf(const std::vector<Vec3d>& vertices, const std::vector<Vec<uint32_t, 3>>& triangles) {
    if (triangles.empty()) throw ValueError("a mesh without faces cannot be drawn");
    Box box{vertices.at(triangles[0][0]), vertices.at(triangles[0][0])};
    for (const auto& triangle : triangles)
        for (const uint32_t k : triangle.c)
            for (int axis = 0; axis < 3; ++axis) {
                box.lower[axis] = std::min(box.lower[axis], vertices.at(k)[axis]);
                box.upper[axis] = std::max(box.upper[axis], vertices.at(k)[axis]);
            }
    if (!box.finite() || !(length(box.size()) > 0)) throw ValueError("a mesh without size cannot be drawn");
    return box;
}

#if RTC_VERSION_MAJOR >= 4
void intersect(RTCScene scene, RTCRayHit& query) { rtcIntersect1(scene, &query); }
void occlude(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &ray); }
#else
void intersect(RTCScene scene, RTCRayHit& query) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &query);
}
void occlude(RTCScene scene, RTCRay& ray) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene, &context, &ray);
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

} // namespace

struct RayMesh::Scene {
    Scene() : device(rtcNewDevice("isa=avx2")), scene(nullptr) {
        if (!device) throw ResourceError("Embree could not be started");
        scene = rtcNewScene(device);
    }
    ~Scene() {
        rtcReleaseScene(scene);
        rtcReleaseDevice(device);
    }
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;

    void check() const {
        if (rtcGetDeviceError(device) != RTC_ERROR_NONE) throw ResourceError("Embree has no memory for this mesh");
    }

    RTCDevice device;
    RTCScene scene;
};

RayMesh::RayMesh(std::vector<Vec3d> vertices, std::vector<Vec<uint32_t, 3>> triangles)
    : mVertices(std::move(vertices)),
      mTriangles(std::move(triangles)),
      mBox(boundsOf(mVertices, mTriangles)),
      mCenter(mBox.center()),
      mScale(1 / length(mBox.size())),
      mScene(std::make_unique<Scene>()) {
    const RTCGeometry geometry = rtcNewGeometry(mScene->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* const positions = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mVertices.size()));
    auto* const corners = static_cast<uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(uint32_t), mTriangles.size()));
    if (positions && corners) {
        for (size_t k = 0; k < mVertices.size(); ++k)
            for (int axis = 0; axis < 3; ++axis)
                positions[3 * k + static_cast<size_t>(axis)] =
                    static_cast<float>((mVertices[k][axis] - mCenter[axis]) * mScale);
        for (size_t k = 0; k < mTriangles.size(); ++k)
            std::copy(mTriangles[k].c.begin(), mTriangles[k].c.end(), corners + 3 * k);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(mScene->scene, geometry);
    }
    rtcReleaseGeometry(geometry);
    rtcSetSceneFlags(mScene->scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(mScene->scene, RTC_BUILD_QUALITY_MEDIUM);
    rtcCommitScene(mScene->scene);
    mScene->check();
}

RayMesh::~RayMesh() = default;

std::optional<RayMesh::Hit> RayMesh::hit(const Ray& ray) const {
    RTCRayHit query{};
    query.ray = queryOf((ray.origin - mCenter) * mScale, ray.direction);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    intersect(mScene->scene, query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    // Intersect the triangle's plane in double (Möller and Trumbore 1997).
    const auto& corners = mTriangles[query.hit.primID];
    const Vec3d a = mVertices[corners[0]], ab = mVertices[corners[1]] - a, ac = mVertices[corners[2]] - a;
    const Vec3d across = cross(ray.direction, ac), from = ray.origin - a;
    const double determinant = dot(ab, across);
    Hit hit{.distance = static_cast<double>(query.ray.tfar) / mScale, .triangle = query.hit.primID};
    hit.u = static_cast<double>(query.hit.u), hit.v = static_cast<double>(query.hit.v);
    if (!(std::abs(determinant) > 1e-12 * length(ab) * length(ac))) return hit; // the triangle is seen edge-on
    const Vec3d beside = cross(from, ab);
    const double distance = dot(ac, beside) / determinant;
    if (!(std::abs(distance - hit.distance) * mScale < 1e-3)) return hit;
    hit.distance = distance;
    hit.u = std::clamp(dot(from, across) / determinant, 0.0, 1.0);
    hit.v = std::clamp(dot(ray.direction, beside) / determinant, 0.0, 1 - hit.u);
    return hit;
}

bool RayMesh::occluded(const Ray& ray) const {
    RTCRay query = queryOf((ray.origin - mCenter) * mScale, ray.direction);
    occlude(mScene->scene, query);
    return query.tfar < 0;
}

} // namespace curlew
