// SPDX-License-Identifier: Apache-2.0
//
// How variables cease to be estimated.
#include <algorithm>
#include <memory>
#include <optional>

#include "backend/conditioned_factor.h"
#include "backend/incremental_solver_impl.h"

namespace ignis {
namespace {

bool are_among(const gtsam::KeyVector& keys, const auto& set) {
  return std::ranges::all_of(keys, [&](gtsam::Key key) { return set.contains(key); });
}

}  // namespace

std::optional<Eigen::MatrixXd> IncrementalSolver::covariance_among(std::span<const std::uint64_t> keys,
                                                                   std::span<const std::uint64_t> wanted) {
  if (!impl_->broken.empty()) return std::nullopt;
  const gtsam::KeySet set(keys.begin(), keys.end());
  gtsam::NonlinearFactorGraph factors;
  for (const auto& factor : impl_->factors) {
    if (factor && are_among(factor->keys(), set)) factors.push_back(factor);
  }
  const gtsam::Values& solution = impl_->estimate_of(keys);
  gtsam::Values values;
  for (const gtsam::Key key : keys) values.insert(key, solution.at(key));
  Eigen::Index rows = 0;
  for (const gtsam::Key key : wanted) rows += static_cast<Eigen::Index>(values.at(key).dim());
  Isam2::Sum one_below_the_other;
  Eigen::Index row = 0;
  for (const gtsam::Key key : wanted) {
    const auto size = static_cast<Eigen::Index>(values.at(key).dim());
    one_below_the_other.push_back({key, Eigen::MatrixXd::Zero(rows, size)});
    one_below_the_other.back().factor.middleRows(row, size).setIdentity();
    row += size;
  }
  try {
    Isam2 part(impl_->params);
    part.advance(factors, values, {});
    Eigen::MatrixXd covariance = part.covariance(one_below_the_other);
    if (covariance.allFinite()) return covariance;
  } catch (const std::exception&) {
    // They do not determine themselves.
  }
  return std::nullopt;
}

bool IncrementalSolver::fix(std::span<const std::uint64_t> keys, const gtsam::NonlinearFactorGraph& instead) {
  if (!impl_->broken.empty()) return false;
  impl_->estimate();
  auto next = std::make_unique<Impl>(impl_->params);
  next->values = impl_->values;
  next->fixed = impl_->fixed;
  for (const gtsam::Key key : keys) {
    next->fixed.insert(key, next->values.at(key));
    next->values.erase(key);
  }
  const gtsam::KeySet said = instead.keys();
  for (const auto& factor : impl_->factors) {
    const auto open = factor ? conditioned(factor, next->fixed) : nullptr;
    next->factors.push_back(open && !are_among(open->keys(), said) ? open : nullptr);
  }
  for (const auto& factor : instead) next->factors.push_back(factor);
  next->isam_index.resize(next->factors.size());
  next->errors.resize(next->factors.size(), Impl::kUnknownError);
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

}  // namespace ignis
