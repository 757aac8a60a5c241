// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/ray_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace ignis::sim {
namespace {

constexpr int kLeafSize = 3;
/// Median splits keep the depth at log2 of the count, so this holds for any scene that fits in memory.
constexpr int kStackSize = 64;

/// Where the ray enters the box, or infinity when it misses it or enters beyond `limit`.
double entry(const Eigen::AlignedBox3d& box, const Ray& ray, const Eigen::Array3d& inverse_direction, double limit) {
  const Eigen::Array3d a = (box.min() - ray.origin).array() * inverse_direction;
  const Eigen::Array3d b = (box.max() - ray.origin).array() * inverse_direction;
  const double enter = std::max(a.min(b).maxCoeff(), 0.0);
  const double leave = std::min(a.max(b).minCoeff(), limit);
  return enter <= leave ? enter : std::numeric_limits<double>::infinity();
}

/// A component of exactly zero would make 0 * infinity = NaN in `entry` for a ray that runs in a face of a box.
Eigen::Array3d safe_inverse(const Eigen::Vector3d& direction) {
  constexpr double kTiny = 1e-30;
  return direction.array().unaryExpr([](double d) { return 1.0 / (std::abs(d) < kTiny ? kTiny : d); });
}

}  // namespace

RayScene::RayScene(std::vector<Plane> planes, std::vector<Solid> solids)
    : planes_(std::move(planes)), solids_(std::move(solids)) {
  if (!solids_.empty()) build(0, static_cast<int>(solids_.size()));
}

int RayScene::build(int begin, int end) {
  const int index = static_cast<int>(nodes_.size());
  Node node{.box = {}, .first = begin, .count = end - begin};
  Eigen::AlignedBox3d centers;
  for (int i = begin; i < end; ++i) {
    node.box.extend(bounds(solids_[static_cast<std::size_t>(i)]));
    centers.extend(solids_[static_cast<std::size_t>(i)].center);
  }
  nodes_.push_back(node);
  if (end - begin <= kLeafSize) return index;

  int axis = 0;
  centers.sizes().maxCoeff(&axis);
  const int middle = (begin + end) / 2;
  std::nth_element(solids_.begin() + begin, solids_.begin() + middle, solids_.begin() + end,
                   [axis](const Solid& a, const Solid& b) { return a.center[axis] < b.center[axis]; });
  build(begin, middle);
  const int second = build(middle, end);
  nodes_[static_cast<std::size_t>(index)].first = second;
  nodes_[static_cast<std::size_t>(index)].count = 0;
  return index;
}

std::optional<Hit> RayScene::cast(const Ray& ray, double limit) const {
  std::optional<Hit> nearest;
  const auto keep = [&](const std::optional<Hit>& hit) {
    if (!hit) return;
    nearest = hit;
    limit = hit->distance;
  };
  for (const Plane& plane : planes_) keep(intersect(plane, ray, limit));
  if (nodes_.empty()) return nearest;

  const Eigen::Array3d inverse_direction = safe_inverse(ray.direction);
  struct Pending {
    int node;
    double entry;
  };
  std::array<Pending, kStackSize> stack;
  std::size_t depth = 0;
  stack[depth++] = {0, entry(nodes_[0].box, ray, inverse_direction, limit)};
  while (depth > 0) {
    const Pending pending = stack[--depth];
    if (pending.entry >= limit) continue;
    const Node& node = nodes_[static_cast<std::size_t>(pending.node)];
    for (int i = 0; i < node.count; ++i) {
      keep(intersect(solids_[static_cast<std::size_t>(node.first) + static_cast<std::size_t>(i)], ray, limit));
    }
    if (node.count > 0) continue;
    Pending near{pending.node + 1, 0.0};
    Pending far{node.first, 0.0};
    near.entry = entry(nodes_[static_cast<std::size_t>(near.node)].box, ray, inverse_direction, limit);
    far.entry = entry(nodes_[static_cast<std::size_t>(far.node)].box, ray, inverse_direction, limit);
    if (far.entry < near.entry) std::swap(near, far);
    if (far.entry < limit) stack[depth++] = far;
    if (near.entry < limit) stack[depth++] = near;
  }
  return nearest;
}

double RayScene::clearance(const Eigen::Vector3d& point) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Plane& plane : planes_) nearest = std::min(nearest, signed_distance(plane, point));
  for (const Solid& solid : solids_) nearest = std::min(nearest, signed_distance(solid, point));
  return nearest;
}

}  // namespace ignis::sim
