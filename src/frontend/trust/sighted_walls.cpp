// SPDX-License-Identifier: Apache-2.0
#include "frontend/trust/sighted_walls.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace ignis {
namespace {

constexpr Utime kWindowUs = kMicrosPerSecond;
constexpr int kTrials = 500;  // finds a plane that a fifth of the points lie on in 98 of 100 cases
constexpr std::size_t kMostPoints = 4000;
constexpr std::size_t kPointsTried = 400;  // of which each trial is judged by
constexpr double kThickness = 0.04;        // m: two sigma of a range
constexpr double kSurroundings = 0.4;      // m
constexpr double kMostSigmas = 3.5;        // of the velocity
constexpr double kSteepest = 0.5;          // tangent between the axis and the normal
constexpr int kFewestPoints = 20;
constexpr double kSmallestShare = 0.08;  // of the points that met no plane
constexpr double kClearness = 150.0;     // points, times how much denser they lie than their surroundings
constexpr int kFewestScans = 7;
constexpr double kNarrowest = 1.5;     // m
constexpr double kLowest = 0.8;        // m
constexpr double kSmallPart = 0.3;     // m
constexpr double kLargestCrowd = 0.4;  // of the points, in a small part
constexpr double kFloorSigma = 0.02;   // m/s

/// A point of the last second: across the wall, along it, above the newest, and when [s, 0 at the newest].
struct Sample {
  double across;
  double along;
  double height;
  double time;
};

/// across + slope * along - speed * time = distance.
struct MovingPlane {
  double slope = 0.0;
  double speed = 0.0;
  double distance = 0.0;

  [[nodiscard]] double residual(const Sample& sample) const {
    return (sample.across + slope * sample.along - speed * sample.time - distance) / std::hypot(1.0, slope);
  }
};

/// The same numbers on every machine.
class Draws {
 public:
  std::size_t below(std::size_t end) {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return static_cast<std::size_t>((state_ >> 33U) % end);
  }

 private:
  std::uint64_t state_ = 88172645463325252U;
};

std::optional<MovingPlane> through(const std::array<Sample, 3>& samples) {
  Eigen::Matrix3d lhs;
  Eigen::Vector3d rhs;
  for (int i = 0; i < 3; ++i) {
    const Sample& sample = samples[static_cast<std::size_t>(i)];
    lhs.row(i) << sample.along, -sample.time, -1.0;
    rhs(i) = -sample.across;
  }
  const Eigen::FullPivLU<Eigen::Matrix3d> lu(lhs);
  if (!lu.isInvertible()) return std::nullopt;
  const Eigen::Vector3d solution = lu.solve(rhs);
  return MovingPlane{.slope = solution(0), .speed = solution(1), .distance = solution(2)};
}

struct Fit {
  MovingPlane plane;
  double speed_variance = 0.0;
};

/// Least squares over the samples within the thickness of `plane`.
std::optional<Fit> refined(const MovingPlane& plane, std::span<const Sample> samples) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  double squares = 0.0;
  int count = 0;
  for (const Sample& sample : samples) {
    if (std::abs(plane.residual(sample)) > kThickness) continue;
    const Eigen::Vector3d row(sample.along, -sample.time, -1.0);
    normal += row * row.transpose();
    rhs -= row * sample.across;
    squares += plane.residual(sample) * plane.residual(sample);
    ++count;
  }
  const Eigen::FullPivLU<Eigen::Matrix3d> lu(normal);
  if (count < kFewestPoints || !lu.isInvertible()) return std::nullopt;
  const Eigen::Vector3d solution = lu.solve(rhs);
  return Fit{.plane = {.slope = solution(0), .speed = solution(1), .distance = solution(2)},
             .speed_variance = lu.inverse()(1, 1) * squares / count};
}

int support(const MovingPlane& plane, std::span<const Sample> samples) {
  return static_cast<int>(std::ranges::count_if(
      samples, [&](const Sample& sample) { return std::abs(plane.residual(sample)) <= kThickness; }));
}

std::optional<MovingPlane> best_of_trials(std::span<const Sample> samples, double fastest) {
  std::vector<Sample> tried;
  const std::size_t step = std::max<std::size_t>(samples.size() / kPointsTried, 1);
  for (std::size_t i = 0; i < samples.size(); i += step) tried.push_back(samples[i]);
  Draws draws;
  std::optional<MovingPlane> best;
  int most = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto draw = [&] { return samples[draws.below(samples.size())]; };
    const std::optional<MovingPlane> plane = through({draw(), draw(), draw()});
    if (!plane || std::abs(plane->speed) > fastest || std::abs(plane->slope) > kSteepest) continue;
    const int count = support(*plane, tried);
    if (count <= most) continue;
    most = count;
    best = plane;
  }
  return best;
}

/// Whether nine tenths of the values take up at least `length`, and no small part of it holds most of them.
bool are_spread_over(std::vector<double> values, double length) {
  std::ranges::sort(values);
  const auto twentieth = static_cast<std::size_t>(std::ssize(values) / 20);
  if (values[values.size() - 1 - twentieth] - values[twentieth] < length) return false;
  const auto crowd = static_cast<std::size_t>(kLargestCrowd * static_cast<double>(values.size()));
  for (std::size_t i = crowd; i < values.size(); ++i) {
    if (values[i] - values[i - crowd] < kSmallPart) return false;
  }
  return true;
}

/// Wide and upright. Where the reach of the sensor ends, or that of the map, floor and walls thin out along a line that
/// goes with the vehicle: most points there lie at one height, or to one side.
bool is_face(std::span<const Sample> samples) {
  std::vector<double> along;
  std::vector<double> height;
  for (const Sample& sample : samples) {
    along.push_back(sample.along);
    height.push_back(sample.height);
  }
  return are_spread_over(std::move(along), kNarrowest) && are_spread_over(std::move(height), kLowest);
}

/// Whether what lies on the plane is a wall: many points of many scans, denser than what surrounds it, and a face.
bool is_wall(const MovingPlane& plane, std::span<const Sample> samples) {
  std::vector<Sample> on_it;
  double surroundings = 0.0;
  int scans = 0;
  for (const Sample& sample : samples) {
    const double distance = std::abs(plane.residual(sample));
    if (distance <= kSurroundings) ++surroundings;
    if (distance > kThickness) continue;
    if (on_it.empty() || sample.time != on_it.back().time) ++scans;
    on_it.push_back(sample);
  }
  if (std::ssize(on_it) < kFewestPoints || scans < kFewestScans) return false;
  const auto points = static_cast<double>(on_it.size());
  const double contrast = points / (kThickness / kSurroundings * surroundings);
  return points >= kSmallestShare * static_cast<double>(samples.size()) && points * contrast >= kClearness &&
         is_face(on_it);
}

}  // namespace

void SightedWalls::add_scan(Utime utime, std::span<const Eigen::Vector3d> points) {
  for (const Eigen::Vector3d& point : points) sightings_.push_back({utime, point});
  while (!sightings_.empty() && (sightings_.front().utime <= utime - kWindowUs || sightings_.size() > kMostPoints)) {
    sightings_.pop_front();
  }
  ++scans_since_judged_;
}

void SightedWalls::clear() {
  sightings_.clear();
  scans_since_judged_ = 0;
}

std::optional<VelocityError> SightedWalls::judge(const Eigen::Vector3d& axis, double sigma, double accel_noise) {
  scans_since_judged_ = 0;
  const Eigen::Vector3d level(axis.x(), 0.0, axis.z());
  if (level.norm() < 0.9 || std::ssize(sightings_) < kFewestPoints) return std::nullopt;
  const Eigen::Vector3d across = level.normalized();
  const Eigen::Vector3d along(across.z(), 0.0, -across.x());
  const Sighting& newest = sightings_.back();
  std::vector<Sample> samples;
  samples.reserve(sightings_.size());
  for (const Sighting& sighting : sightings_) {
    const Eigen::Vector3d offset = sighting.point - newest.point;
    samples.push_back(
        {across.dot(offset), along.dot(offset), offset.y(), seconds_between(newest.utime, sighting.utime)});
  }
  std::optional<MovingPlane> plane = best_of_trials(samples, kMostSigmas * sigma);
  if (!plane) return std::nullopt;
  std::optional<Fit> fit;
  for (int pass = 0; pass < 3; ++pass) {
    fit = refined(*plane, samples);
    if (!fit) return std::nullopt;
    plane = fit->plane;
  }
  if (std::abs(plane->slope) > kSteepest || std::abs(plane->speed) > kMostSigmas * sigma || !is_wall(*plane, samples)) {
    return std::nullopt;
  }
  const double length = std::hypot(1.0, plane->slope);
  const double seconds = -samples.front().time;
  VelocityError error;
  error.direction = (across + plane->slope * along) / length;
  error.along = plane->speed / length;
  error.variance =
      fit->speed_variance / (length * length) + accel_noise * accel_noise * seconds / 3.0 + kFloorSigma * kFloorSigma;
  return error;
}

}  // namespace ignis
