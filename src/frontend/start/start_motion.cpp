// SPDX-License-Identifier: Apache-2.0
#include "frontend/start/start_motion.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "common/plane_smoothness.h"
#include "common/so3.h"
#include "frontend/matching/deskew.h"

namespace ignis {
namespace {

constexpr double kWindowSeconds = 0.8;  // an L1 has then looked everywhere eight times
constexpr std::size_t kLeastScans = 4;
constexpr double kFreshSeconds = 0.2;             // at the ends of the window; older scans say nothing of now
constexpr int kUntimedScanUs = 100'000;           // of a scan whose points have no times of their own
constexpr double kMostPoints = 22'000;            // of scans that take a second: all of an L1
constexpr std::size_t kPointsThatSuffice = 5000;  // in a scan, to be laid on the next one whatever the speed
// Speeds that are tried [m/s], forward. Gauss-Newton finds to the true one from a step away.
constexpr double kSlowest = -2.0;
constexpr double kFastest = 6.0;
constexpr double kSpeedStep = 0.5;
constexpr int kPasses = 5;  // from each of them: not yet all of the way
constexpr std::size_t kFinalists = 3;
constexpr int kFinalPasses = 15;
constexpr int kFinalBentPasses = 50;             // speed and acceleration make up for one another, and give way slowly
constexpr std::size_t kConvergingPoints = 6000;  // are enough while it converges
constexpr double kConvergedSpeed = 0.001;        // [m/s] smaller steps lead nowhere
constexpr double kConvergedTurn = 0.0003;        // [rad/s]
// Whether it stood is asked first, and costs little: the evidence of rest is compared with that of these speeds as they
// are. Of 22 drives that began at rest, 9 to 28 times as much in the 14 that the whole search tells, up to 1.5 in the
// others; up to 1.0 where one of 72 drives at 0.3 to 3 m/s had a place to settle near rest.
constexpr double kSpeedStepAtRest = 1.0;
constexpr std::size_t kPointsAtRest = 3000;
constexpr double kDecisiveAtRest = 4.4;
constexpr double kFacing = 0.5;      // cosine
constexpr double kPriorTurn = 0.05;  // [rad/s] sigma, the most that passes for a bias
constexpr double kPriorSpeed = 0.5;  // [m/s] sigma, about where a search begins
constexpr double kDistance = 0.06;   // [m] sigma of a point's distance, of points that share the error of their plane
// Of the best speed's evidence over that of all that are not near it. At 0.3 to 3 m/s: 2.4 to 23 where something faces
// the way, with an L1 and one search alone from 3.9. Up to 2.2 for a wrong speed, of one search alone, in corridors and
// empty halls; up to 1.4 in those at rest.
constexpr double kDecisive = 2.2;
constexpr double kDecisiveAlone = 3.5;  // where only one search led there
// What is left may be a mirage: a speed that brings rings on floor and walls, or what lies along them, into planes.
// kLeastFacing [s^2]: of points that face the way, with the squared time between them and their plane. 4 to 150 for
// true speeds; up to 3 for wrong ones with 16 beams in an empty hall. Along a corridor these have 5 to 24.
constexpr double kLeastFacing = 3.5;
// Of the time over which all scans are spread about such a point, squared, how much lies beside it at rest. 0.003 to
// 0.27 for true speeds from 0.2 m/s on, 0.54 to 1.07 for wrong ones and in corridors.
constexpr double kMostThatRestExplains = 0.4;
constexpr double kMeeting = 0.2;      // [m/s] between searches that led to the same speed
constexpr double kSameSpeed = 0.3;    // [m/s] and that are on their way there
constexpr double kSpeedSigma = 0.03;  // [m/s] of what is found, beside what the points' noise makes
constexpr double kTurnSigma = 0.003;  // [rad/s]
// The same where the motion bends: of 53 starts in motion the speed was off by 0.05 m/s, the tilt by 1.0 degrees
// (rms).
constexpr double kBentStandingSpeed = 0.1;  // [m/s] scans of a vehicle that stands make up to 0.06
constexpr double kBentSpeedSigma = 0.05;    // [m/s]
constexpr double kAccelerationSigma = 0.1;  // [m/s^2] with the accelerometer's bias 0.7 degrees of tilt per axis

using Motion9 = Eigen::Matrix<double, 9, 1>;

/// Where a point of an earlier instant lies now, if the motion is constant in body axes.
Eigen::Vector3d carried(const Vector6d& twist, double seconds, const Eigen::Vector3d& point) {
  const Eigen::Vector3d turn = twist.head<3>();
  const Eigen::Vector3d velocity = twist.tail<3>();
  return so3::rotate_a_little(turn * seconds, point) + seconds * (velocity + 0.5 * seconds * turn.cross(velocity));
}

/// The same beside the inertial unit, which has turned point and axes already but for the gyro's bias: velocity and
/// acceleration are those of the newest instant's axes.
Eigen::Vector3d carried_beside(const Motion9& motion, double seconds, const Eigen::Vector3d& point) {
  return so3::rotate_a_little(motion.head<3>() * seconds, point) +
         seconds * (motion.segment<3>(3) + 0.5 * seconds * motion.tail<3>());
}

double forward_speed(const Motion9& motion) { return -motion[5]; }

Motion9 at_speed(double speed) {
  Motion9 motion = Motion9::Zero();
  motion[5] = -speed;
  return motion;
}

Motion9 without_acceleration(const Vector6d& twist) {
  Motion9 motion = Motion9::Zero();
  motion.head<6>() = twist;
  return motion;
}

}  // namespace

StartMotion::StartMotion(const FrontendConfig& config)
    : config_(config), selector_(config), finder_(config), map_(config) {}

void StartMotion::add(const Scan& scan) {
  newest_points_ = scan.points.size();
  Scan& kept = scans_.emplace_back(selector_.select(scan).scan);
  const double seconds = 1e-6 * static_cast<double>(kept.duration_us > 0 ? kept.duration_us : kUntimedScanUs);
  const auto most = static_cast<std::size_t>(kMostPoints * seconds);
  const std::size_t all = kept.points.size();
  if (all > most) {
    for (std::size_t i = 0; i < most; ++i) kept.points[i] = kept.points[i * all / most];
    kept.points.resize(most);
  }
  while (seconds_between(scans_.front().end_utime(), scan.end_utime()) > kWindowSeconds) scans_.pop_front();
}

bool StartMotion::has_dense_scans() const { return newest_points_ >= kPointsThatSuffice; }

bool StartMotion::has_scans() const { return scans_.size() >= kLeastScans; }

bool StartMotion::has_window_until(Utime now) const {
  return has_scans() && seconds_between(newest(), now) < kFreshSeconds &&
         seconds_between(scans_.front().utime, newest()) > kWindowSeconds - kFreshSeconds;
}

/// Fills measured_ with the points as they are.
void StartMotion::measure() {
  measured_.clear();
  for (const Scan& scan : scans_) {
    for (const ScanPoint& point : scan.points) {
      measured_.push_back({point.position.cast<double>(), seconds_between(newest(), scan.utime + point.dt_us)});
    }
  }
}

/// Fills samples_ and map_, whose scans are numbered from 1.
void StartMotion::place(const Motion& motion) {
  map_.clear();
  samples_.clear();
  std::vector<Eigen::Vector3f> placed;
  auto next = measured_.begin();
  for (const Scan& scan : scans_) {
    placed.clear();
    for (std::size_t i = 0; i < scan.points.size(); ++i, ++next) {
      const Eigen::Vector3d point = bends_ ? carried_beside(motion, next->seconds, next->point)
                                           : carried(motion.head<6>(), next->seconds, next->point);
      samples_.push_back({point, next->seconds});
      placed.push_back(samples_.back().point.cast<float>());
    }
    map_.insert(std::span<const Eigen::Vector3f>(placed), Pose{}, true);
  }
}

/// Middle of the scan of that number; between two scans, between theirs.
double StartMotion::seconds_of(double scan) const {
  const auto middle = [&](std::size_t i) {
    return seconds_between(scans_.back().end_utime(), scans_[i].utime + scans_[i].duration_us / 2);
  };
  const double index = std::clamp(scan - 1.0, 0.0, static_cast<double>(scans_.size() - 1));
  const auto before = std::min(static_cast<std::size_t>(index), scans_.size() - 2);
  return middle(before) + (index - static_cast<double>(before)) * (middle(before + 1) - middle(before));
}

/// Of every `stride`th point the plane of its neighbours. A small change of the twist moves the point against them by
/// the time between it and them, one of the acceleration by half of what lies between the squares of their times.
StartMotion::Look StartMotion::look(const Motion& motion, std::size_t stride) {
  place(motion);
  queries_.clear();
  for (std::size_t i = 0; i < samples_.size(); i += stride) queries_.push_back(samples_[i].point);
  Motion prior_sigma;
  prior_sigma << Eigen::Vector3d::Constant(kPriorTurn), Eigen::Vector3d::Constant(kPriorSpeed),
      Eigen::Vector3d::Constant(config_.moving_accel_sigma);
  MotionMatrix information = prior_sigma.array().square().inverse().matrix().asDiagonal();
  Motion gradient = Motion::Zero();
  if (bends_) gradient.tail<3>() = -information.bottomRightCorner<3, 3>() * motion.tail<3>();
  double facing = 0.0;
  std::vector<std::size_t> witnesses;
  double roughness = 0.0;  // [m^2] sum of variances
  double count = 0.0;
  const std::span<const PlaneFit> planes = finder_.find(map_, queries_, Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const PlaneFit& plane = planes[i];
    if (plane.verdict != PlaneVerdict::kPlane) continue;
    const double plane_seconds = seconds_of(plane.mean_scan);
    const double seconds = samples_[i * stride].seconds - plane_seconds;
    const double half_sum = 0.5 * (samples_[i * stride].seconds + plane_seconds);
    Motion h;
    h << queries_[i].cross(plane.normal), plane.normal, half_sum * plane.normal;
    h *= seconds;
    const double smoothness = plane_smoothness(plane.scatter[0], config_.smooth_plane_m);
    const double weight = static_cast<double>(stride) * smoothness / (kDistance * kDistance);
    information += weight * h * h.transpose();
    gradient += weight * h * plane.normal.dot(plane.offset);
    if (std::abs(plane.normal.z()) > kFacing) {
      facing += smoothness * seconds * seconds;
      witnesses.push_back(i * stride);
    }
    roughness += plane.scatter[0];
    ++count;
  }
  // A rough wall along the way, smeared, makes many planes that face it. It makes all planes rougher.
  const double mean_roughness = count > 0.0 ? roughness / count : 1.0;
  Look look;
  if (bends_) {
    look.step = information.ldlt().solve(gradient);
    look.covariance = information.inverse();
  } else {
    const Matrix6d of_twist = information.topLeftCorner<6, 6>();
    look.step.head<6>() = of_twist.ldlt().solve(gradient.head<6>());
    look.covariance.topLeftCorner<6, 6>() = of_twist.inverse();
  }
  look.facing = static_cast<double>(stride) * facing;
  look.evidence = static_cast<double>(stride) * facing / (mean_roughness * mean_roughness);
  look.witnesses = std::move(witnesses);
  return look;
}

/// One point in so many leaves at most that many, and no less than half of them where there are more.
std::size_t StartMotion::stride_to(std::size_t points) const {
  std::size_t all = 0;
  for (const Scan& scan : scans_) all += scan.points.size();
  return all / points + 1;
}

/// Steps with one point in `stride` until they are small; the evidence is that of one in `last_stride`.
StartMotion::Candidate StartMotion::refined(Motion motion, int passes, std::size_t stride, std::size_t last_stride) {
  for (int pass = 0; pass < passes; ++pass) {
    const Motion step = look(motion, stride).step;
    motion += step;
    if (step.segment<3>(3).norm() < kConvergedSpeed && step.head<3>().norm() < kConvergedTurn) break;
  }
  return {motion, look(motion, last_stride)};
}

/// No surer than drives have shown it to be.
SteadyMotion StartMotion::told(const Candidate& found) {
  SteadyMotion motion{.twist = found.motion.head<6>(), .covariance = found.last.covariance.topLeftCorner<6, 6>()};
  motion.covariance.diagonal().head<3>().array() += kTurnSigma * kTurnSigma;
  motion.covariance.diagonal().tail<3>().array() += kSpeedSigma * kSpeedSigma;
  return motion;
}

/// Beside the inertial unit a turn is none, but the gyro's bias.
bool StartMotion::is_rolling(const Candidate& found) const {
  return bends_ ? found.motion.segment<3>(3).norm() > kBentStandingSpeed : told(found).is_rolling();
}

/// Nothing where it is not plain that it stood.
std::optional<StartMotion::Candidate> StartMotion::find_rest() {
  const std::size_t stride = stride_to(kPointsAtRest);
  const Candidate rest = refined(Motion::Zero(), kPasses, stride, stride);
  if (is_rolling(rest)) return std::nullopt;
  for (double speed = kSlowest; speed <= kFastest; speed += kSpeedStepAtRest) {
    const bool is_other = std::abs(speed) > 0.5 * kSpeedStepAtRest;
    if (is_other && rest.last.evidence < kDecisiveAtRest * look(at_speed(speed), stride).evidence) return std::nullopt;
  }
  return rest.last.evidence > 0.0 ? std::optional(rest) : std::nullopt;
}

/// What faces the way and lies at rest where other moments saw it too is no surface that the vehicle came nearer to.
bool StartMotion::rest_explains(std::span<const std::size_t> witnesses) {
  place(Motion::Zero());
  const double middle = 0.5 * samples_.front().seconds;
  double at_rest = 0.0;
  double in_all = 0.0;
  for (const std::size_t i : witnesses) {
    const NeighbourMoments here = map_.gather(samples_[i].point, config_.voxel_size_m);
    if (here.count == 0) continue;
    const double apart = samples_[i].seconds - seconds_of(here.scan_sum / here.weight);
    at_rest += apart * apart;
    in_all += (samples_[i].seconds - middle) * (samples_[i].seconds - middle);
  }
  return !(at_rest < kMostThatRestExplains * in_all);
}

std::optional<SteadyMotion> StartMotion::find() {
  if (!has_scans()) return std::nullopt;
  measure();
  const std::optional<Candidate> found = search();
  return found ? std::optional(told(*found)) : std::nullopt;
}

std::optional<BentMotion> StartMotion::find_beside(const NavState& standing, std::span<const ImuSample> samples,
                                                   double gravity_m) {
  if (!has_scans()) return std::nullopt;
  measure();
  Scan all;
  all.utime = scans_.front().utime;
  all.duration_us = static_cast<std::int32_t>(newest() - all.utime);
  for (const Scan& scan : scans_) {
    for (const ScanPoint& point : scan.points) {
      const auto dt_us =
          static_cast<std::int32_t>(scan.utime - all.utime) + std::clamp(point.dt_us, 0, scan.duration_us);
      all.points.push_back({point.position, point.intensity, dt_us});
    }
  }
  const std::vector<CloudPoint> moved = deskew(all, standing, samples, gravity_m);
  for (std::size_t i = 0; i < moved.size(); ++i) measured_[i].point = moved[i].position.cast<double>();
  bends_ = true;
  std::optional<Candidate> bent = search();
  if (bent) bent = refined(bent->motion, kFinalBentPasses, stride_to(kConvergingPoints), 1);
  bends_ = false;
  if (!bent) return std::nullopt;
  const double variance = bent->last.covariance.diagonal().tail<3>().maxCoeff();
  BentMotion found{.steady = told(*bent),
                   .acceleration = bent->motion.tail<3>(),
                   .acceleration_sigma = std::sqrt(variance + kAccelerationSigma * kAccelerationSigma)};
  found.steady.covariance.diagonal().tail<3>().array() += kBentSpeedSigma * kBentSpeedSigma;
  return found;
}

std::optional<StartMotion::Candidate> StartMotion::search() {
  if (const std::optional<Candidate> rest = find_rest()) return rest;
  const std::size_t stride = stride_to(kConvergingPoints);
  std::vector<Candidate> candidates;
  for (double speed = kSlowest; speed <= kFastest; speed += kSpeedStep) {
    candidates.push_back(refined(at_speed(speed), kPasses, stride, stride));
  }
  const auto evidence = [](const Candidate& candidate) { return candidate.last.evidence; };
  std::ranges::sort(candidates, std::ranges::greater(), evidence);
  const auto finalists = std::span(candidates).first(kFinalists);
  for (Candidate& candidate : finalists) {
    candidate = refined(candidate.motion, bends_ ? kFinalBentPasses : kFinalPasses, stride, 1);
  }
  const Candidate& best = *std::ranges::max_element(finalists, {}, evidence);
  const auto is_near = [&](const Candidate& other, double within) {
    return std::abs(forward_speed(other.motion) - forward_speed(best.motion)) < within;
  };
  const bool is_met_again =
      std::ranges::count_if(candidates, [&](const Candidate& other) { return is_near(other, kMeeting); }) > 1;
  const double decisive = is_met_again ? kDecisive : kDecisiveAlone;
  const bool is_decisive = std::ranges::all_of(candidates, [&](const Candidate& other) {
    return is_near(other, kSameSpeed) || evidence(best) > decisive * evidence(other);
  });
  if (!is_decisive) return std::nullopt;
  const bool is_mirage = is_rolling(best) && (best.last.facing < kLeastFacing || rest_explains(best.last.witnesses));
  return is_mirage ? std::nullopt : std::optional(best);
}

void StartMotion::fill_placed(LocalMap& map, const Pose& T_odom_newest) const {
  std::vector<Eigen::Vector3f> points;
  auto next = samples_.begin();
  for (const Scan& scan : scans_) {
    points.clear();
    for (std::size_t i = 0; i < scan.points.size(); ++i) points.push_back((next++)->point.cast<float>());
    map.insert(std::span<const Eigen::Vector3f>(points), T_odom_newest, true);
  }
}

void StartMotion::fill(LocalMap& map, const SteadyMotion& motion, Utime now, const Pose& T_odom_body) {
  const double seconds = seconds_between(now, newest());
  const Motion twist = without_acceleration(motion.twist);
  const Pose T_now_newest{so3::exp(motion.twist.head<3>() * seconds),
                          carried(motion.twist, seconds, Eigen::Vector3d::Zero())};
  place(twist);
  fill_placed(map, T_odom_body * T_now_newest);
}

void StartMotion::fill(LocalMap& map, const BentMotion& motion, const Pose& T_odom_body) {
  Motion all;
  all << motion.steady.twist, motion.acceleration;
  bends_ = true;
  place(all);
  bends_ = false;
  fill_placed(map, T_odom_body);
}

}  // namespace ignis
