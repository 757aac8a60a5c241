// SPDX-License-Identifier: Apache-2.0
//
// How variables cease to be estimated.
#include <gtsam/linear/GaussianFactorGraph.h>
#include <gtsam/linear/VectorValues.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "backend/solver/conditioned_factor.h"
#include "backend/solver/incremental_solver_impl.h"

namespace ignis {
namespace {

bool are_among(const gtsam::KeyVector& keys, const auto& set) {
  return std::ranges::all_of(keys, [&](gtsam::Key key) { return set.contains(key); });
}

Isam2::Sum one_below_the_other(std::span<const gtsam::Key> keys, const gtsam::Values& values) {
  Eigen::Index rows = 0;
  for (const gtsam::Key key : keys) rows += static_cast<Eigen::Index>(values.at(key).dim());
  Isam2::Sum sum;
  Eigen::Index row = 0;
  for (const gtsam::Key key : keys) {
    const auto size = static_cast<Eigen::Index>(values.at(key).dim());
    sum.push_back({key, Eigen::MatrixXd::Zero(rows, size)});
    sum.back().factor.middleRows(row, size).setIdentity();
    row += size;
  }
  return sum;
}

}  // namespace

std::optional<SolverSummary> IncrementalSolver::summary_of(std::span<const std::uint64_t> keys,
                                                           std::span<const std::uint64_t> wanted) {
  if (!impl_->broken.empty()) return std::nullopt;
  const gtsam::KeySet set(keys.begin(), keys.end());
  gtsam::NonlinearFactorGraph factors;
  for (const auto& factor : impl_->factors) {
    if (factor && are_among(factor->keys(), set)) factors.push_back(factor);
  }
  const gtsam::KeySet named = factors.keys();
  if (!are_among(gtsam::KeyVector(keys.begin(), keys.end()), named)) return std::nullopt;
  const gtsam::Values& solution = impl_->estimate_of(keys);
  gtsam::Values values;
  for (const gtsam::Key key : keys) values.insert(key, solution.at(key));
  try {
    const gtsam::VectorValues slope = factors.linearize(values)->gradientAtZero();
    const gtsam::Vector slope_of_wanted = slope.vector(gtsam::KeyVector(wanted.begin(), wanted.end()));
    Isam2 part(impl_->params);
    part.advance(factors, values, {});
    SolverSummary summary;
    summary.covariance = part.covariance(one_below_the_other(wanted, values));
    summary.offset = -summary.covariance * slope_of_wanted;
    if (summary.covariance.allFinite() && summary.offset.allFinite()) return summary;
    return std::nullopt;
  } catch (const std::exception&) {
    // They do not determine themselves.
    return std::nullopt;
  }
}

bool IncrementalSolver::fix(std::span<const std::uint64_t> known, std::span<const std::uint64_t> forgotten,
                            const gtsam::NonlinearFactorGraph& instead) {
  if (!impl_->broken.empty()) return false;
  impl_->estimate();
  auto next = std::make_unique<Impl>(impl_->params);
  next->values = impl_->values;
  next->fixed = impl_->fixed;
  for (const gtsam::Key key : known) next->fixed.insert(key, next->values.at(key));
  gtsam::Values held = next->fixed;
  for (const gtsam::Key key : forgotten) held.insert(key, next->values.at(key));
  for (const auto& keys : {known, forgotten}) {
    for (const gtsam::Key key : keys) next->values.erase(key);
  }
  gtsam::NonlinearFactorGraph prior;
  for (const auto& factor : instead) prior.push_back(conditioned(factor, held));
  const gtsam::KeySet said = prior.keys();
  for (const auto& factor : impl_->factors) {
    const auto open = factor ? conditioned(factor, held) : nullptr;
    next->factors.push_back(open && !are_among(open->keys(), said) ? open : nullptr);
  }
  for (const auto& factor : prior) next->factors.push_back(factor);
  next->isam_index.resize(next->factors.size());
  next->errors.resize(next->factors.size(), Impl::kUnknownError);
  next->changed = impl_->changed;
  next->relinearised = impl_->relinearised;
  next->relinearised.insert(known.begin(), known.end());
  next->rebuilds = impl_->rebuilds;
  next->rebuild();
  if (!next->broken.empty()) return false;
  impl_ = std::move(next);
  return true;
}

void IncrementalSolver::add_fixed(const gtsam::Values& values) { impl_->fixed.insert(values); }

void IncrementalSolver::release(std::span<const std::uint64_t> known) {
  for (const gtsam::Key key : known) impl_->fixed.erase(key);
}

const gtsam::Values& IncrementalSolver::fixed() const { return impl_->fixed; }

}  // namespace ignis
