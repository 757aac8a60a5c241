// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/ray_kernel.h"

#include <algorithm>
#include <cmath>
#include <format>
#include <limits>
#include <stdexcept>
#include <string>

#include <embree4/rtcore.h>

namespace ignis::sim {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

float rounded_up(double x) { return std::nextafter(static_cast<float>(x), std::numeric_limits<float>::infinity()); }
float rounded_down(double x) { return std::nextafter(static_cast<float>(x), -std::numeric_limits<float>::infinity()); }

/// What Embree hands through to the callbacks: the exact ray, and the nearest solid so far.
struct Query {
  RTCRayQueryContext context;  ///< first, so that the callback gets from Embree's pointer to the query
  const Ray* ray = nullptr;
  double limit = 0.0;
  std::optional<Hit> solid_hit;
};

void bounds_of_solid(const RTCBoundsFunctionArguments* arguments) {
  const auto& solids = *static_cast<const std::vector<Solid>*>(arguments->geometryUserPtr);
  const Eigen::AlignedBox3d box = bounds(solids[arguments->primID]);
  RTCBounds& out = *arguments->bounds_o;
  out.lower_x = rounded_down(box.min().x());
  out.lower_y = rounded_down(box.min().y());
  out.lower_z = rounded_down(box.min().z());
  out.upper_x = rounded_up(box.max().x());
  out.upper_y = rounded_up(box.max().y());
  out.upper_z = rounded_up(box.max().z());
}

void intersect_solid(const RTCIntersectFunctionNArguments* arguments) {
  if (arguments->valid[0] == 0) return;
  const auto& solids = *static_cast<const std::vector<Solid>*>(arguments->geometryUserPtr);
  auto& query = *reinterpret_cast<Query*>(arguments->context);
  auto& ray_hit = *reinterpret_cast<RTCRayHit*>(arguments->rayhit);
  // A triangle met before shortens only Embree's ray.
  const double limit = std::min(query.limit, static_cast<double>(ray_hit.ray.tfar));
  const std::optional<Hit> hit = intersect(solids[arguments->primID], *query.ray, limit);
  if (!hit) return;
  query.solid_hit = hit;
  query.limit = hit->distance;
  ray_hit.ray.tfar = rounded_up(hit->distance);
  ray_hit.hit.geomID = arguments->geomID;
  ray_hit.hit.primID = arguments->primID;
}

RTCRayHit to_embree(const Ray& ray, double limit) {
  RTCRayHit ray_hit{};
  ray_hit.ray.org_x = static_cast<float>(ray.origin.x());
  ray_hit.ray.org_y = static_cast<float>(ray.origin.y());
  ray_hit.ray.org_z = static_cast<float>(ray.origin.z());
  ray_hit.ray.dir_x = static_cast<float>(ray.direction.x());
  ray_hit.ray.dir_y = static_cast<float>(ray.direction.y());
  ray_hit.ray.dir_z = static_cast<float>(ray.direction.z());
  ray_hit.ray.tnear = 0.0F;
  ray_hit.ray.tfar = rounded_up(limit);
  ray_hit.ray.mask = ~0U;
  ray_hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  return ray_hit;
}

/// Shrinks the search of a point query to the nearest triangle.
struct NearestTriangle {
  const std::vector<TriangleMesh>* meshes = nullptr;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  double distance = kInfinity;
};

bool visit_triangle(RTCPointQueryFunctionArguments* arguments) {
  auto& nearest = *static_cast<NearestTriangle*>(arguments->userPtr);
  if (arguments->geomID >= nearest.meshes->size()) return false;
  const double distance = distance_to((*nearest.meshes)[arguments->geomID], arguments->primID, nearest.point);
  if (distance >= nearest.distance) return false;
  nearest.distance = distance;
  arguments->query->radius = rounded_up(distance);
  return true;
}

}  // namespace

/// Meshes carry their index as Embree's id, the solids the id after the last mesh.
struct RayKernel::Impl {
  std::vector<Solid> solids;
  std::vector<TriangleMesh> meshes;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  ~Impl() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  void attach(RTCGeometry geometry, std::size_t id) const {
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, static_cast<unsigned>(id));
    rtcReleaseGeometry(geometry);
  }

  void attach_solids() {
    if (solids.empty()) return;
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(solids.size()));
    rtcSetGeometryUserData(geometry, &solids);
    rtcSetGeometryBoundsFunction(geometry, bounds_of_solid, nullptr);
    rtcSetGeometryIntersectFunction(geometry, intersect_solid);
    attach(geometry, meshes.size());
  }

  void attach_mesh(std::size_t index) const {
    const TriangleMesh& mesh = meshes[index];
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), mesh.vertices.size()));
    auto* corners = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), mesh.triangles.size()));
    if (vertices != nullptr && corners != nullptr) {
      for (const Eigen::Vector3f& vertex : mesh.vertices) vertices = std::copy_n(vertex.data(), 3, vertices);
      for (const auto& triangle : mesh.triangles) corners = std::ranges::copy(triangle, corners).out;
    }
    attach(geometry, index);
  }

  void require_success() const {
    const RTCError error = rtcGetDeviceError(device);
    if (error == RTC_ERROR_NONE) return;
    throw std::runtime_error(std::format("Embree could not prepare the scene: {}", rtcGetErrorString(error)));
  }
};

RayKernel::RayKernel(std::vector<Solid> solids, std::vector<TriangleMesh> meshes) : impl_(std::make_unique<Impl>()) {
  impl_->solids = std::move(solids);
  impl_->meshes = std::move(meshes);
  impl_->device = rtcNewDevice("threads=1,set_affinity=0");
  impl_->require_success();
  impl_->scene = rtcNewScene(impl_->device);
  // No gaps at shared edges, and boxes are entered even when single precision puts the ray just outside.
  rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST);
  for (std::size_t i = 0; i < impl_->meshes.size(); ++i) impl_->attach_mesh(i);
  impl_->attach_solids();
  rtcCommitScene(impl_->scene);
  impl_->require_success();
}

RayKernel::~RayKernel() = default;
RayKernel::RayKernel(RayKernel&&) noexcept = default;
RayKernel& RayKernel::operator=(RayKernel&&) noexcept = default;

std::optional<Hit> RayKernel::cast(const Ray& ray, double limit) const {
  Query query;
  rtcInitRayQueryContext(&query.context);
  query.ray = &ray;
  query.limit = limit;
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &query.context;
  RTCRayHit ray_hit = to_embree(ray, limit);
  rtcIntersect1(impl_->scene, &ray_hit, &arguments);

  const std::size_t id = ray_hit.hit.geomID;
  if (id >= impl_->meshes.size()) return query.solid_hit;
  const std::optional<Hit> hit = intersect_plane_of(impl_->meshes[id], ray_hit.hit.primID, ray);
  return hit && hit->distance > 0.0 && hit->distance < limit ? hit : std::nullopt;
}

double RayKernel::clearance(const Eigen::Vector3d& point) const {
  double nearest = kInfinity;
  for (const Solid& solid : impl_->solids) nearest = std::min(nearest, signed_distance(solid, point));
  if (impl_->meshes.empty()) return nearest;

  NearestTriangle triangle{.meshes = &impl_->meshes, .point = point};
  RTCPointQuery query{static_cast<float>(point.x()), static_cast<float>(point.y()), static_cast<float>(point.z()), 0.0F,
                      std::numeric_limits<float>::infinity()};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(impl_->scene, &query, &context, visit_triangle, &triangle);
  return std::min(nearest, triangle.distance);
}

const std::vector<Solid>& RayKernel::solids() const { return impl_->solids; }
const std::vector<TriangleMesh>& RayKernel::meshes() const { return impl_->meshes; }

}  // namespace ignis::sim
