// SPDX-License-Identifier: Apache-2.0
#include "frontend/planes/four_planes.h"

#include <array>
#include <cmath>

namespace ignis {
namespace {

constexpr int kMaxSteps = 16;
constexpr float kConverged = 1e-4F;  // of the trace: the step after it would be of the order of its square
constexpr float kParallel = 1e-10F;  // squared sine between rows that say nothing about their normal
constexpr float kNothing = 1e-30F;   // a trace or a length that is none

struct Vector {
  Lanes x, y, z;
};

/// A symmetric matrix.
struct Symmetric {
  Lanes xx, xy, xz, yy, yz, zz;
};

/// Eigenvalues, ascending, and unit vectors in the same order.
struct Axes {
  std::array<Lanes, 3> values;
  std::array<Vector, 3> vectors;
};

Lanes dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

Vector cross(const Vector& a, const Vector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

Vector scaled(const Vector& v, Lanes by) { return {v.x * by, v.y * by, v.z * by}; }

/// a * s + b * t
Vector combined(const Vector& a, Lanes s, const Vector& b, Lanes t) {
  return {a.x * s + b.x * t, a.y * s + b.y * t, a.z * s + b.z * t};
}

Vector chosen(LaneMask mask, const Vector& a, const Vector& b) {
  return {mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
}

Vector product(const Symmetric& A, const Vector& v) {
  return {A.xx * v.x + A.xy * v.y + A.xz * v.z, A.xy * v.x + A.yy * v.y + A.yz * v.z,
          A.xz * v.x + A.yz * v.y + A.zz * v.z};
}

/// Two unit vectors across a unit vector and across each other. T. Duff et al., "Building an Orthonormal Basis,
/// Revisited", Journal of Computer Graphics Techniques 6(1), 2017.
std::array<Vector, 2> across(const Vector& n) {
  const Lanes sign = n.z < Lanes{} ? all(-1.0F) : all(1.0F);
  const Lanes a = -1.0F / (sign + n.z);
  const Lanes b = n.x * n.y * a;
  return {{{1.0F + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}}};
}

/// Smallest eigenvalue of matrices of trace 1: Newton's method from zero, as in scatter_axes.
Lanes smallest_root(const Symmetric& A) {
  const Lanes yyzz = A.yy * A.zz - A.yz * A.yz;
  const Lanes minors = A.xx * A.yy - A.xy * A.xy + A.xx * A.zz - A.xz * A.xz + yyzz;
  const Lanes determinant = A.xx * yyzz - A.xy * (A.xy * A.zz - A.yz * A.xz) + A.xz * (A.xy * A.yz - A.yy * A.xz);
  Lanes root{};
  LaneMask active = root == root;
  for (int step = 0; step < kMaxSteps && any(active); ++step) {
    const Lanes value = determinant + root * (root * (1.0F - root) - minors);
    const Lanes fall = minors - root * (2.0F - 3.0F * root);
    active &= (value > Lanes{}) & (fall > Lanes{});
    const Lanes change = active ? value / (active ? fall : all(1.0F)) : Lanes{};
    root += change;
    active &= change >= all(kConverged);
  }
  return root;
}

/// Unit vectors that the rows of singular matrices have in common as their normal.
Vector null_vector(const Symmetric& M) {
  const Vector rows[] = {{M.xx, M.xy, M.xz}, {M.xy, M.yy, M.yz}, {M.xz, M.yz, M.zz}};
  Vector normal = cross(rows[0], rows[1]);
  Lanes normal2 = dot(normal, normal);
  for (const Vector& other : {cross(rows[0], rows[2]), cross(rows[1], rows[2])}) {
    const Lanes other2 = dot(other, other);
    normal = chosen(other2 > normal2, other, normal);
    normal2 = other2 > normal2 ? other2 : normal2;
  }
  Vector longest = rows[0];
  Lanes longest2 = dot(longest, longest);
  for (const Vector& other : {rows[1], rows[2]}) {
    const Lanes other2 = dot(other, other);
    longest = chosen(other2 > longest2, other, longest);
    longest2 = other2 > longest2 ? other2 : longest2;
  }
  const LaneMask stands_apart = normal2 > kParallel * longest2 * longest2 + kNothing;
  normal = scaled(normal, 1.0F / square_root(stands_apart ? normal2 : all(1.0F)));
  if (!any(~stands_apart)) return normal;
  const LaneMask has_length = longest2 > all(kNothing);
  const Vector line = scaled(longest, 1.0F / square_root(has_length ? longest2 : all(1.0F)));
  const Vector unit_x{all(1.0F), Lanes{}, Lanes{}};
  return chosen(stands_apart, normal, chosen(has_length, across(line)[0], unit_x));
}

Axes axes_of(const Symmetric& scatter) {
  const Lanes trace = scatter.xx + scatter.yy + scatter.zz;
  const LaneMask is_something = trace > all(kNothing);
  const Lanes inverse = is_something ? 1.0F / (is_something ? trace : all(1.0F)) : Lanes{};
  const Symmetric A = {scatter.xx * inverse, scatter.xy * inverse, scatter.xz * inverse,
                       scatter.yy * inverse, scatter.yz * inverse, scatter.zz * inverse};
  const Lanes smallest = smallest_root(A);
  const Vector normal = null_vector({A.xx - smallest, A.xy, A.xz, A.yy - smallest, A.yz, A.zz - smallest});

  const auto [u, v] = across(normal);
  const Vector Au = product(A, u);
  const Lanes uu = dot(u, Au);
  const Lanes uv = dot(v, Au);
  const Lanes vv = dot(v, product(A, v));
  const Lanes mean = 0.5F * (uu + vv);
  const Lanes half = 0.5F * (uu - vv);
  const Lanes radius = square_root(half * half + uv * uv);
  // Of the two forms of the vector to mean + radius the one without cancellation.
  const LaneMask is_along_u = half > Lanes{};
  const Lanes major_u = is_along_u ? half + radius : uv;
  const Lanes major_v = is_along_u ? uv : radius - half;
  const Lanes length2 = major_u * major_u + major_v * major_v;
  const LaneMask has_major = length2 > all(kNothing);
  const Lanes shrink = 1.0F / square_root(has_major ? length2 : all(1.0F));
  const Lanes c = has_major ? major_u * shrink : all(1.0F);
  const Lanes s = has_major ? major_v * shrink : Lanes{};
  const Lanes size = is_something ? trace : Lanes{};
  return {{size * smallest, size * (mean - radius), size * (mean + radius)},
          {normal, combined(v, c, u, -s), combined(u, c, v, s)}};
}

Eigen::Vector3d lane_of(const Vector& v, int k) { return {v.x[k], v.y[k], v.z[k]}; }

}  // namespace

void fit_four_planes(const FourMoments& moments, const FrontendConfig& config, double radius,
                     std::span<PlaneFit* const> fits) {
  const LaneMask enough = moments.count >= all(static_cast<float>(config.min_plane_points));
  if (!any(enough)) {
    for (PlaneFit* fit : fits) *fit = {};
    return;
  }

  const Lanes inverse_weight = 1.0F / (enough ? moments.weight : all(1.0F));
  const Vector offset = scaled({moments.sum[0], moments.sum[1], moments.sum[2]}, inverse_weight);
  const Vector view = scaled({moments.view_sum[0], moments.view_sum[1], moments.view_sum[2]}, inverse_weight);
  const Lanes mean_scan = moments.scan_sum * inverse_weight;
  const auto& outer = moments.sum_outer;
  const Axes axes =
      axes_of({outer[0] * inverse_weight - offset.x * offset.x, outer[1] * inverse_weight - offset.x * offset.y,
               outer[2] * inverse_weight - offset.x * offset.z, outer[3] * inverse_weight - offset.y * offset.y,
               outer[4] * inverse_weight - offset.y * offset.z, outer[5] * inverse_weight - offset.z * offset.z});
  std::array<Lanes, 3> lambda;
  for (std::size_t i = 0; i < 3; ++i) lambda[i] = axes.values[i] > Lanes{} ? axes.values[i] : Lanes{};
  const Vector& normal = axes.vectors[0];

  const Vector tangential = combined(offset, all(1.0F), normal, -dot(normal, offset));
  const float reach = static_cast<float>(config.max_centroid_offset * radius);
  const float roughest = static_cast<float>(config.max_surface_roughness);
  const LaneMask flat = lambda[0] < static_cast<float>(config.max_curvature) * lambda[2];
  const float narrowest = static_cast<float>(config.min_plane_width_m);
  const LaneMask wide =
      (lambda[1] > static_cast<float>(config.min_spread) * lambda[2]) & (lambda[1] >= all(narrowest * narrowest));
  const LaneMask around = dot(tangential, tangential) <= all(reach * reach);
  const LaneMask smooth = lambda[0] <= all(roughest * roughest);

  // Three degrees of freedom went into the plane itself.
  const Lanes freedom = moments.count > all(4.0F) ? moments.count - 3.0F : all(1.0F);
  const LaneMask is_plane = enough & flat & wide & around & smooth;
  const Lanes thickness = lambda[0] / freedom;
  const Lanes slope_1 = square_root(is_plane ? thickness / (is_plane ? lambda[1] : all(1.0F)) : Lanes{});
  const Lanes slope_2 = square_root(is_plane ? thickness / (is_plane ? lambda[2] : all(1.0F)) : Lanes{});
  const Vector sigma_1 = scaled(axes.vectors[1], slope_1);
  const Vector sigma_2 = scaled(axes.vectors[2], slope_2);

  for (int k = 0; k < static_cast<int>(fits.size()); ++k) {
    PlaneFit& fit = *fits[static_cast<std::size_t>(k)];
    if (enough[k] == 0) {
      fit = {};
      continue;
    }
    fit.verdict = flat[k] == 0     ? PlaneVerdict::kBlob
                  : wide[k] == 0   ? PlaneVerdict::kLine
                  : around[k] == 0 ? PlaneVerdict::kOneSided
                  : smooth[k] == 0 ? PlaneVerdict::kRough
                                   : PlaneVerdict::kPlane;
    fit.normal = lane_of(normal, k);
    fit.offset = lane_of(offset, k);
    fit.normal_sigma << lane_of(sigma_1, k), lane_of(sigma_2, k);
    fit.count = static_cast<int>(moments.count[k]);
    fit.points = moments.weight[k];
    fit.scatter << lambda[0][k], lambda[1][k], lambda[2][k];
    fit.mean_scan = mean_scan[k];
    fit.view = lane_of(view, k);
  }
}

}  // namespace ignis
