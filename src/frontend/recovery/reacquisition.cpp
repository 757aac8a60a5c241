// SPDX-License-Identifier: Apache-2.0
#include "frontend/recovery/reacquisition.h"

#include <algorithm>
#include <cmath>
#include <format>
#include <functional>
#include <iterator>
#include <optional>

#include "frontend/filter/regained_view.h"
#include "frontend/matching/scan_update.h"
#include "frontend/planes/plane_fit.h"
#include "frontend/planes/plane_jacobian.h"
#include "frontend/recovery/place_search.h"

namespace ignis {
namespace {

using Points = std::vector<Eigen::Vector3f>;

constexpr double kLargestRadiusVoxels = 20.0;  // beyond, planes of another place are as near
constexpr double kShrink = 0.8;                // of the radius, per pass
constexpr int kMostPasses = 30;
constexpr double kNoisePerRadius = 0.25;  // sigma of a distance while the pairs are still guesses
constexpr double kIndependent = 50.0;     // planes that a scan amounts to: neighbouring points repeat one another
constexpr std::size_t kSearchPoints = 200;
constexpr std::size_t kScorePoints = 600;
constexpr std::size_t kMostPlaces = 8;
// From here on: chosen over the same 282 places as kIndependentPoints. In 77 there is doubt, among them all 19 at which
// a wrong one comes first (docs/results/gaps_and_starts.md, After a stretch without corrections).
constexpr double kPlaceNoise = 0.1;      // m, sigma: of a point at the right place, attitude and map included
constexpr double kNoPlane = 0.7;         // what a point counts for that is near the map, but near no plane
constexpr double kUnmapped = 0.4;        // and one where the map holds nothing within kUnmappedRadius
constexpr double kUnmappedRadius = 1.0;  // m
constexpr double kOtherPlace = 0.3;      // m: farther apart, two hypotheses are two places
constexpr double kClearlyBetter = 3.0;   // by its log-likelihood
constexpr double kMeetsTheMap = 0.6;     // share of the points
constexpr double kFine = 0.03;           // m, sigma: of a point at the right place, once the pose is right
constexpr double kFits = 0.6;            // share of the planes' points, by that
constexpr double kExpected = 3.0;        // sigmas of the prediction

/// Of those that are not too far, evenly spread.
Points some_of(std::span<const Eigen::Vector3f> points, std::size_t most) {
  Points near;
  const auto is_near = [](const Eigen::Vector3f& point) { return point.norm() <= kFarthestSearchPoint; };
  std::ranges::copy_if(points, std::back_inserter(near), is_near);
  Points some;
  const std::size_t step = std::max<std::size_t>((near.size() + most - 1) / most, 1);
  for (std::size_t i = 0; i < near.size(); i += step) some.push_back(near[i]);
  return some;
}

double bell(double sigmas) { return std::exp(-0.5 * sigmas * sigmas); }

struct Hypothesis {
  NavState state;
  double log_likelihood = 0.0;
  double sigmas = 0.0;    ///< from the prediction
  double near_map = 0.0;  ///< share of the points
  double fits = 0.0;      ///< of the points at planes, the share that lies in them
};

/// Leads one scan to places and says how good they are.
class PlaceJudge {
 public:
  PlaceJudge(const FilterState& predicted, std::span<const Eigen::Vector3f> points_body, const LocalMap& map,
             const FrontendConfig& config)
      : predicted_(predicted),
        search_points_(some_of(points_body, kSearchPoints)),
        score_points_(some_of(points_body, kScorePoints)),
        map_(map),
        config_(config) {}

  [[nodiscard]] double finest() const { return std::max(config_.match_radius_m, config_.wide_match_radius_m); }

  /// Coarse to fine, from `state` on.
  [[nodiscard]] NavState refined(NavState state, const Points& points, double radius) const {
    for (int pass = 0; pass < kMostPasses && radius > finest(); ++pass, radius *= kShrink) {
      const PoseInformation pairs = paired(state.T_odom_body, points, radius);
      if (pairs.count < config_.min_matches) break;
      const UpdateStep update = information_update(predicted_.covariance, difference(predicted_.nominal, state), pairs);
      if (!update.ok) break;
      state = perturbed(state, update.step);
    }
    return state;
  }

  /// From the prediction on.
  [[nodiscard]] NavState approached(const Points& points) const {
    const double sigma = largest_axis_sigma(predicted_.covariance, kPosition);
    const double radius = std::min(kPlaceSigmas * sigma, kLargestRadiusVoxels * config_.voxel_size_m);
    return refined(predicted_.nominal, points, radius);
  }

  /// All that the prediction allows for, best first.
  [[nodiscard]] std::vector<Hypothesis> hypotheses() const {
    std::vector<Hypothesis> found{judged(approached(search_points_))};
    for (const Eigen::Vector3d& position : likely_places(predicted_, search_points_, map_, kMostPlaces)) {
      NavState state = predicted_.nominal;
      state.T_odom_body.translation = position;
      found.push_back(judged(refined(state, search_points_, 2.0 * finest())));
    }
    std::ranges::stable_sort(found, std::greater{}, &Hypothesis::log_likelihood);
    return found;
  }

 private:
  [[nodiscard]] PlaneFit plane_at(const Eigen::Vector3d& point) const {
    const double radius = 2.0 * config_.match_radius_m;
    return fit_plane(map_.gather(point, radius), config_, radius);
  }

  /// Distances of the points from the planes at their nearest map points.
  [[nodiscard]] PoseInformation paired(const Pose& pose, const Points& points, double radius) const {
    const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
    const double sigma = kNoisePerRadius * radius;
    const double variance = sigma * sigma * std::max(1.0, static_cast<double>(points.size()) / kIndependent);
    PoseInformation sum;
    for (const Eigen::Vector3f& point : points) {
      const Eigen::Vector3d point_body = point.cast<double>();
      const Eigen::Vector3d query = R * point_body + pose.translation;
      const std::optional<Eigen::Vector3d> nearest = map_.nearest(query, radius);
      if (!nearest) continue;
      const PlaneFit plane = plane_at(*nearest);
      if (plane.verdict != PlaneVerdict::kPlane) continue;
      const Vector6d h = plane_jacobian(R, point_body, plane.normal);
      sum.add(h, plane.normal.dot(query - *nearest - plane.offset), variance);
    }
    return sum;
  }

  [[nodiscard]] Hypothesis judged(const NavState& state) const {
    const Pose& pose = state.T_odom_body;
    const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
    int near = 0;
    int at_planes = 0;
    double support = 0.0;
    double fine_support = 0.0;
    for (const Eigen::Vector3f& point : score_points_) {
      const Eigen::Vector3d query = R * point.cast<double>() + pose.translation;
      const std::optional<Eigen::Vector3d> nearest = map_.nearest(query, finest());
      if (!nearest) {
        support += map_.nearest(query, std::max(kUnmappedRadius, 2.0 * finest())) ? 0.0 : kUnmapped;
        continue;
      }
      ++near;
      const PlaneFit plane = plane_at(*nearest);
      if (plane.verdict != PlaneVerdict::kPlane) {
        support += kNoPlane;
        continue;
      }
      ++at_planes;
      const double distance = plane.normal.dot(query - *nearest - plane.offset);
      support += bell(distance / kPlaceNoise);
      fine_support += bell(distance / kFine);
    }
    const double share = 1.0 / std::max(static_cast<double>(score_points_.size()), 1.0);
    const Eigen::Vector3d shift = pose.translation - predicted_.nominal.T_odom_body.translation;
    const Eigen::Matrix3d P = predicted_.covariance.block<3, 3>(kPosition, kPosition);
    const double sigmas2 = shift.dot(P.inverse() * shift);
    return {.state = state,
            .log_likelihood = kIndependentPoints * share * support - 0.5 * sigmas2,
            .sigmas = std::sqrt(sigmas2),
            .near_map = share * near,
            .fits = fine_support / std::max(at_planes, 1)};
  }

  const FilterState& predicted_;
  Points search_points_;
  Points score_points_;
  const LocalMap& map_;
  const FrontendConfig& config_;
};

/// The directions to all other places that are nearly as good.
std::vector<Eigen::Vector3d> ways_to_rivals(const std::vector<Hypothesis>& hypotheses) {
  const Hypothesis& best = hypotheses.front();
  std::vector<Eigen::Vector3d> axes;
  for (const Hypothesis& other : hypotheses) {
    const Eigen::Vector3d way = other.state.T_odom_body.translation - best.state.T_odom_body.translation;
    if (way.norm() <= kOtherPlace || best.log_likelihood - other.log_likelihood > kClearlyBetter) continue;
    const Eigen::Vector3d across = way - projector_on(axes) * way;
    if (across.norm() > kOtherPlace) axes.push_back(across.normalized());
  }
  return axes;
}

/// Why a place may be none at all; empty where nothing speaks against it.
std::string doubt_about(const Hypothesis& best) {
  if (best.near_map < kMeetsTheMap)
    return std::format("place: {:.0f} % of the points meet the map", 100.0 * best.near_map);
  if (best.fits < kFits) return std::format("place: {:.0f} % of the points lie in its planes", 100.0 * best.fits);
  if (best.sigmas > kExpected) return std::format("place: {:.1f} sigma from where it was expected", best.sigmas);
  return {};
}

std::string rivals_in_words(const std::vector<Eigen::Vector3d>& axes) {
  std::string words;
  for (const Eigen::Vector3d& axis : axes) {
    words += std::format("{}place along odom ({:.2f}, {:.2f}, {:.2f}), where another fits as well",
                         words.empty() ? "" : "; ", axis.x(), axis.y(), axis.z());
  }
  return words;
}

}  // namespace

Pose approached(const FilterState& predicted, std::span<const Eigen::Vector3f> points_body, const LocalMap& map,
                const FrontendConfig& config) {
  return PlaceJudge(predicted, points_body, map, config)
      .approached({points_body.begin(), points_body.end()})
      .T_odom_body;
}

Reacquisition reacquire(const FilterState& predicted, std::span<const Eigen::Vector3f> points_body, const LocalMap& map,
                        const FrontendConfig& config) {
  const PlaceJudge judge(predicted, points_body, map, config);
  const double reach = kPlaceSigmas * largest_axis_sigma(predicted.covariance, kPosition);
  if (points_body.empty() || !predicted.covariance.allFinite() || reach <= judge.finest()) {
    return {.T_odom_body = predicted.nominal.T_odom_body, .doubtful = {}, .doubt = {}};
  }
  const std::vector<Hypothesis> hypotheses = judge.hypotheses();
  const Hypothesis& best = hypotheses.front();
  Reacquisition found{.T_odom_body = best.state.T_odom_body, .doubtful = {}, .doubt = {}};
  found.doubt = reach > kFarthestPlace ? std::format("place: searched within {:.0f} of {:.1f} m", kFarthestPlace, reach)
                                       : doubt_about(best);
  if (!found.doubt.empty()) {
    found.doubtful = {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()};
    return found;
  }
  found.doubtful = ways_to_rivals(hypotheses);
  found.doubt = rivals_in_words(found.doubtful);
  return found;
}

}  // namespace ignis
