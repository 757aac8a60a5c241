// SPDX-License-Identifier: Apache-2.0
#include "backend/incremental_solver.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/linear/linearExceptions.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/Values.h>

#include <algorithm>
#include <boost/unordered/unordered_flat_set.hpp>
#include <cmath>
#include <format>
#include <limits>
#include <utility>

#include "backend/conditioned_factor.h"
#include "backend/isam2.h"
#include "common/config_check.h"

namespace ignis {
namespace {

Isam2Settings settings(const SolverConfig& config) {
  Isam2Settings settings;
  gtsam::Vector6 pose;
  pose << gtsam::Vector3::Constant(config.relinearize_rotation_rad),
      gtsam::Vector3::Constant(config.relinearize_position_m);
  settings.thresholds['x'] = pose;
  settings.thresholds['v'] = gtsam::Vector3::Constant(config.relinearize_velocity);
  settings.thresholds['b'] = gtsam::Vector6::Constant(config.relinearize_bias);
  settings.relinearize_skip = config.relinearize_skip;
  // The usual 0.001 stops back-substitution while poses are still a millimetre off; then a solver that is built anew
  // from the same factors would stand elsewhere.
  settings.wildfire_threshold = config.wildfire_threshold;
  return settings;
}

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

std::string name_of(gtsam::Key key) { return std::string(gtsam::Symbol(key)); }

}  // namespace

struct IncrementalSolver::Impl {
  explicit Impl(Isam2Settings how) : params(std::move(how)), isam(params) {}

  /// Why the batch must not reach GTSAM, or an empty text.
  [[nodiscard]] std::string problem(const gtsam::NonlinearFactorGraph& batch, const gtsam::Values& news) {
    if (!broken.empty()) return broken;
    for (const gtsam::Key key : news.keys()) {
      if (exists(key)) return std::format("variable {} exists already", name_of(key));
    }
    for (const auto& factor : batch) {
      bool is_open = false;
      for (const gtsam::Key key : factor->keys()) {
        if (!news.exists(key) && !exists(key))
          return std::format("a factor names the unknown variable {}", name_of(key));
        is_open = is_open || !fixed.exists(key);
      }
      if (!is_open) return std::format("a factor on {} names only what is fixed", name_of(factor->keys().front()));
      if (!std::isfinite(factor->error(around(*factor, news)))) {
        return std::format("a factor on {} has an error that is not finite", name_of(factor->keys().front()));
      }
    }
    return {};
  }

  [[nodiscard]] bool exists(gtsam::Key key) const { return isam.exists(key) || fixed.exists(key); }

  /// Where the factor's variables are, those of `news` there.
  [[nodiscard]] gtsam::Values around(const gtsam::NonlinearFactor& factor, const gtsam::Values& news) {
    gtsam::Values places;
    for (const gtsam::Key key : factor.keys()) {
      if (news.exists(key)) {
        places.insert(key, news.at(key));
      } else if (fixed.exists(key)) {
        places.insert(key, fixed.at(key));
      } else {
        places.insert(key, estimate_of(std::span(&key, 1)).at(key));
      }
    }
    return places;
  }

  /// One update of iSAM2; the reason if it failed.
  [[nodiscard]] std::string update(const gtsam::NonlinearFactorGraph& batch, const gtsam::Values& news,
                                   std::span<const std::size_t> removed, std::vector<std::size_t>& indices) {
    try {
      Isam2::Step step = isam.advance(batch, news, removed);
      indices = std::move(step.new_factors);
      for (const gtsam::Key key : news.keys()) relinearised.insert(key);
      relinearised.insert(step.relinearised.begin(), step.relinearised.end());
      is_settled = step.relinearised.empty();
      stale.insert(step.moved.begin(), step.moved.end());
      changed.insert(changed.end(), step.moved.begin(), step.moved.end());
    } catch (const gtsam::IndeterminantLinearSystemException& e) {
      return std::format("the graph is undetermined near {}", name_of(e.nearbyVariable()));
    } catch (const std::exception& e) {
      return std::format("the solver threw: {}", e.what());
    }
    return {};
  }

  /// A new iSAM2 from the living factors at the last good solution. Should even that fail, the solver keeps its last
  /// solution and refuses everything from then on.
  void rebuild() {
    isam = Isam2(params);
    // Should it fail, linearisation_points() are these values from now on.
    for (const gtsam::Key key : values.keys()) relinearised.insert(key);
    stale.clear();
    id_of.clear();
    gtsam::NonlinearFactorGraph living;
    std::vector<FactorId> ids;
    for (FactorId id = 0; id < factors.size(); ++id) {
      if (!factors[id]) continue;
      living.push_back(factors[id]);
      ids.push_back(id);
    }
    std::vector<std::size_t> indices;
    if (const std::string failure = update(living, values, {}, indices); !failure.empty()) {
      broken = "the graph cannot be rebuilt: " + failure;
      return;
    }
    for (std::size_t i = 0; i < ids.size(); ++i) place(ids[i], indices[i]);
  }

  /// Notes that iSAM2 knows the factor as `index`.
  void place(FactorId id, std::size_t index) {
    isam_index[id] = index;
    if (id_of.size() <= index) id_of.resize(index + 1);
    id_of[index] = id;
  }

  void recover() {
    ++rebuilds;
    rebuild();
  }

  const gtsam::Values& estimate() {
    for (const gtsam::Key key : stale) refresh(key);
    stale.clear();
    return values;
  }

  const gtsam::Values& estimate_of(std::span<const gtsam::Key> keys) {
    for (const gtsam::Key key : keys) {
      if (stale.erase(key) > 0) refresh(key);
    }
    return values;
  }

  void refresh(gtsam::Key key) {
    gtsam::Value* moved = isam.linearisation_points().at(key).retract_(isam.offset(key));
    values.update(key, *moved);
    moved->deallocate_();
    for (const std::size_t index : isam.factors_of(key)) errors[id_of[index]] = kUnknown;
  }

  [[nodiscard]] gtsam::Pose3 linearisation_point(gtsam::Key key) const {
    if (fixed.exists(key)) return fixed.at<gtsam::Pose3>(key);
    return (broken.empty() ? isam.linearisation_points() : values).at<gtsam::Pose3>(key);
  }

  /// What the offsets of two poses make of the offset of the second against the first, in body axes of the second. What
  /// is fixed has none.
  [[nodiscard]] Isam2::Sum relative_terms(const KeyPair& pair) const {
    const auto& [from, to] = pair;
    const gtsam::Matrix6 A = -linearisation_point(to).between(linearisation_point(from)).AdjointMap();
    Isam2::Sum terms{{from, A}, {to, gtsam::I_6x6}};
    std::erase_if(terms, [&](const Isam2::Term& term) { return fixed.exists(term.key); });
    return terms;
  }

  double error_of(FactorId id) {
    const gtsam::Values& around = estimate_of(factors.at(id)->keys());
    if (std::isnan(errors[id])) errors[id] = factors[id]->error(around);
    return errors[id];
  }

  Isam2Settings params;
  Isam2 isam;
  std::vector<gtsam::NonlinearFactor::shared_ptr> factors;  ///< by FactorId; empty when removed
  std::vector<std::size_t> isam_index;                      ///< by FactorId
  std::vector<double> errors;                               ///< by FactorId: half chi-square at `values`, or kUnknown
  std::vector<FactorId> id_of;                              ///< by index in iSAM2
  gtsam::Values values;  ///< of each variable, the last solution that was asked for, or its first value
  gtsam::Values fixed;   ///< variables that are estimated no more
  boost::unordered_flat_set<gtsam::Key> stale;         ///< variables that iSAM2 has moved since
  std::vector<gtsam::Key> changed;                     ///< variables that it has moved since take_changed()
  boost::unordered_flat_set<gtsam::Key> relinearised;  ///< that it has linearised anew since take_relinearised()
  bool is_settled = false;                             ///< the last update linearised nothing anew
  int rebuilds = 0;
  std::string broken;  ///< why nothing is accepted any more; empty while all is well
};

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
    impl_->errors.push_back(kUnknown);
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

bool IncrementalSolver::fix(std::span<const std::uint64_t> keys) {
  if (!impl_->broken.empty()) return false;
  impl_->estimate();
  auto next = std::make_unique<Impl>(impl_->params);
  next->values = impl_->values;
  next->fixed = impl_->fixed;
  for (const gtsam::Key key : keys) {
    next->fixed.insert(key, next->values.at(key));
    next->values.erase(key);
  }
  for (const auto& factor : impl_->factors) next->factors.push_back(factor ? conditioned(factor, next->fixed) : factor);
  next->isam_index.resize(next->factors.size());
  next->errors.resize(next->factors.size(), kUnknown);
  next->changed = impl_->changed;
  next->relinearised = impl_->relinearised;
  next->relinearised.insert(keys.begin(), keys.end());
  next->rebuilds = impl_->rebuilds;
  next->rebuild();
  if (!next->broken.empty()) return false;
  impl_ = std::move(next);
  return true;
}

void IncrementalSolver::add_fixed(const gtsam::Values& values) { impl_->fixed.insert(values); }

const gtsam::Values& IncrementalSolver::fixed() const { return impl_->fixed; }

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
