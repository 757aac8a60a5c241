// SPDX-License-Identifier: Apache-2.0
#include "backend/solver/incremental_solver.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/Values.h>

#include <algorithm>
#include <format>
#include <utility>

#include "backend/solver/conditioned_factor.h"
#include "backend/solver/incremental_solver_impl.h"
#include "common/config_check.h"

namespace ignis {
namespace {

Isam2Settings settings(const SolverConfig& config) {
  Isam2Settings settings;
  gtsam::Vector6 pose;
  pose << gtsam::Vector3::Constant(config.relinearize_rotation_rad),
      gtsam::Vector3::Constant(config.relinearize_position_m);
  settings.thresholds['x'] = pose;
  settings.thresholds['p'] =
      gtsam::Vector3(config.relinearize_position_m, config.relinearize_position_m, config.relinearize_rotation_rad);
  settings.thresholds['v'] = gtsam::Vector3::Constant(config.relinearize_velocity);
  settings.thresholds['b'] = gtsam::Vector6::Constant(config.relinearize_bias);
  settings.relinearize_skip = config.relinearize_skip;
  // The usual 0.001 stops back-substitution while poses are still a millimetre off; then a solver that is built anew
  // from the same factors would stand elsewhere.
  settings.wildfire_threshold = config.wildfire_threshold;
  return settings;
}

}  // namespace

IncrementalSolver::IncrementalSolver(const SolverConfig& config) {
  config::require_valid(config, "backend.solver");
  impl_ = std::make_unique<Impl>(settings(config));
}

IncrementalSolver::~IncrementalSolver() = default;
IncrementalSolver::IncrementalSolver(IncrementalSolver&&) noexcept = default;
IncrementalSolver& IncrementalSolver::operator=(IncrementalSolver&&) noexcept = default;

SolverOutcome IncrementalSolver::add(const gtsam::NonlinearFactorGraph& factors, const gtsam::Values& values) {
  SolverOutcome outcome;
  outcome.reason = impl_->problem(factors, values);
  if (!outcome.reason.empty()) return outcome;
  gtsam::NonlinearFactorGraph open;
  for (const auto& factor : factors) open.push_back(conditioned(factor, impl_->fixed));
  std::vector<std::size_t> indices;
  outcome.reason = impl_->update(open, values, {}, indices);
  if (!outcome.reason.empty()) {
    impl_->recover();
    return outcome;
  }
  for (std::size_t i = 0; i < open.size(); ++i) {
    const FactorId id = impl_->factors.size();
    outcome.factors.push_back(id);
    impl_->factors.push_back(open[i]);
    impl_->isam_index.push_back(0);
    impl_->errors.push_back(Impl::kUnknownError);
    impl_->place(id, indices[i]);
  }
  impl_->values.insert(values);
  outcome.accepted = true;
  return outcome;
}

SolverOutcome IncrementalSolver::remove(std::span<const FactorId> factors) {
  SolverOutcome outcome;
  outcome.reason = impl_->broken;
  if (!outcome.reason.empty()) return outcome;
  std::vector<std::size_t> removed;
  for (const FactorId id : factors) {
    if (id >= impl_->factors.size() || !impl_->factors[id]) {
      outcome.reason = std::format("there is no factor {}", id);
      return outcome;
    }
    removed.push_back(impl_->isam_index[id]);
  }
  for (const FactorId id : factors) impl_->factors[id].reset();
  std::vector<std::size_t> none;
  outcome.reason = impl_->update({}, {}, removed, none);
  if (!outcome.reason.empty()) impl_->recover();
  outcome.accepted = true;
  return outcome;
}

bool IncrementalSolver::settle(int updates) {
  // iSAM2 looks at the thresholds in one of relinearize_skip updates. If it finds nothing there, it never will.
  int idle = 0;
  for (int i = 0; i < updates && idle < impl_->params.relinearize_skip && impl_->broken.empty(); ++i) {
    std::vector<std::size_t> none;
    if (!impl_->update({}, {}, {}, none).empty()) {
      impl_->recover();
      return false;
    }
    idle = impl_->is_settled ? idle + 1 : 0;
  }
  // Should iSAM2 have to be built anew one day, then not where the graph was before a large correction.
  impl_->estimate();
  return impl_->broken.empty();
}

const gtsam::Values& IncrementalSolver::estimate() { return impl_->estimate(); }

const gtsam::Values& IncrementalSolver::estimate_of(std::span<const std::uint64_t> keys) {
  return impl_->estimate_of(keys);
}

std::vector<std::uint64_t> IncrementalSolver::take_changed() {
  std::vector<std::uint64_t> changed = std::exchange(impl_->changed, {});
  std::ranges::sort(changed);
  const auto twice = std::ranges::unique(changed);
  changed.erase(twice.begin(), twice.end());
  return changed;
}

std::vector<std::uint64_t> IncrementalSolver::take_relinearised() {
  std::vector<gtsam::Key> keys(impl_->relinearised.begin(), impl_->relinearised.end());
  impl_->relinearised.clear();
  std::ranges::sort(keys);
  return keys;
}

const gtsam::Values& IncrementalSolver::linearisation_points() const {
  return impl_->broken.empty() ? impl_->isam.linearisation_points() : impl_->values;
}

gtsam::Pose3 IncrementalSolver::pose(std::uint64_t key) {
  if (impl_->fixed.exists(key)) return impl_->fixed.at<gtsam::Pose3>(key);
  return impl_->estimate_of(std::span(&key, 1)).at<gtsam::Pose3>(key);
}

gtsam::Pose3 IncrementalSolver::linearisation_point(std::uint64_t key) const { return impl_->linearisation_point(key); }

double IncrementalSolver::half_chi_square() {
  double sum = 0.0;
  impl_->estimate();
  for (FactorId id = 0; id < impl_->factors.size(); ++id) {
    if (impl_->factors[id]) sum += impl_->error_of(id);
  }
  return sum;
}

double IncrementalSolver::half_chi_square(FactorId factor) { return impl_->error_of(factor); }

double IncrementalSolver::half_chi_square(const gtsam::NonlinearFactor& factor) {
  return factor.error(impl_->around(factor, {}));
}

std::optional<Eigen::MatrixXd> IncrementalSolver::marginal_covariance(std::uint64_t key) const {
  if (!impl_->broken.empty()) return std::nullopt;  // iSAM2 then lacks variables that its cliques name
  try {
    Eigen::MatrixXd covariance = impl_->isam.covariance(key);
    if (!covariance.allFinite()) return std::nullopt;
    return covariance;
  } catch (const std::exception&) {
    // The covariance is an extra: without it the pose still stands.
    return std::nullopt;
  }
}

Eigen::MatrixXd IncrementalSolver::relative_covariance(std::span<const KeyPair> pairs) const {
  if (!impl_->broken.empty() || pairs.empty()) return {};
  Isam2::Sum all;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (Isam2::Term& term : impl_->relative_terms(pairs[i])) {
      Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(6 * std::ssize(pairs), 6);
      factor.middleRows<6>(6 * static_cast<Eigen::Index>(i)) = term.factor;
      all.push_back({term.key, std::move(factor)});
    }
  }
  Eigen::MatrixXd covariance = impl_->isam.covariance(all);
  if (!covariance.allFinite()) return {};
  return covariance;
}

Eigen::MatrixXd IncrementalSolver::relative_covariance(const KeyPair& pair, std::span<const KeyPair> others) const {
  if (!impl_->broken.empty()) return {};
  std::vector<Isam2::Sum> sums;
  for (const KeyPair& other : others) sums.push_back(impl_->relative_terms(other));
  Eigen::MatrixXd covariance = impl_->isam.covariance(impl_->relative_terms(pair), sums);
  if (!covariance.allFinite()) return {};
  return covariance;
}

Vector6d IncrementalSolver::relative_offset(const KeyPair& pair) const {
  Vector6d offset = Vector6d::Zero();
  for (const Isam2::Term& term : impl_->relative_terms(pair)) offset += term.factor * impl_->isam.offset(term.key);
  return offset;
}

gtsam::NonlinearFactorGraph IncrementalSolver::living_factors() const {
  gtsam::NonlinearFactorGraph living;
  for (const auto& factor : impl_->factors) {
    if (factor) living.push_back(factor);
  }
  return living;
}

bool IncrementalSolver::restart_at(const gtsam::Values& values) {
  if (!impl_->broken.empty()) return false;
  const gtsam::Values before = impl_->estimate();
  impl_->values = values;
  impl_->rebuild();
  if (impl_->broken.empty()) return true;
  impl_->broken.clear();
  impl_->values = before;
  impl_->rebuild();
  return false;
}

const std::string& IncrementalSolver::failure() const { return impl_->broken; }

int IncrementalSolver::rebuilds() const { return impl_->rebuilds; }

}  // namespace ignis
