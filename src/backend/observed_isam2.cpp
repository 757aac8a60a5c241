// SPDX-License-Identifier: Apache-2.0
#include "backend/observed_isam2.h"

#include <gtsam/inference/Symbol.h>
#include <gtsam/linear/GaussianConditional.h>
#include <gtsam/linear/HessianFactor.h>
#include <gtsam/linear/linearExceptions.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <boost/variant/get.hpp>
#include <unordered_set>
#include <utility>
#include <vector>

namespace ignis {
namespace {

/// GTSAM keeps the whole matrix of a clique whose leading rows it has eliminated, though it asks for the rest alone.
void shed_eliminated_rows(gtsam::ISAM2Clique& clique) {
  const auto hessian = boost::dynamic_pointer_cast<gtsam::HessianFactor>(clique.cachedFactor());
  if (!hessian || hessian->info().blockStart() == 0) return;
  auto rest = gtsam::SymmetricBlockMatrix::LikeActiveViewOf(hessian->info());
  rest.setFullMatrix(hessian->augmentedInformation());
  clique.cachedFactor() = boost::make_shared<gtsam::HessianFactor>(hessian->keys(), rest);
}

gtsam::ISAM2Params without_relinearisation(gtsam::ISAM2Params params) {
  params.enableRelinearization = false;
  return params;
}

}  // namespace

ObservedIsam2::ObservedIsam2(const gtsam::ISAM2Params& params)
    : gtsam::ISAM2(without_relinearisation(params)), relinearize_skip_(params.relinearizeSkip) {}

ObservedIsam2::Step ObservedIsam2::advance(const gtsam::NonlinearFactorGraph& factors, const gtsam::Values& values,
                                           const gtsam::FactorIndices& removed) {
  gtsam::KeySet above;
  if ((update_count_ + 1) % relinearize_skip_ == 0) {
    above = above_threshold();
    unchecked_.clear();
  }
  gtsam::ISAM2UpdateParams params;
  params.removeFactorIndices = removed;
  if (!above.empty()) {
    params.extraReelimKeys = with_dependents(above);
    // The order that GTSAM chooses by itself: variables of new and removed factors last, no matter what else is
    // eliminated anew.
    gtsam::FastMap<gtsam::Key, int> last;
    for (const gtsam::Key key : factors.keys()) last[key] = 1;
    for (const std::size_t index : removed) {
      for (const gtsam::Key key : nonlinearFactors_.at(index)->keys()) last[key] = 1;
    }
    if (last.size() >= theta_.size() + values.size()) last.clear();
    params.constrainedKeys = last;
    relinearise(above);
  }
  Step step;
  step.new_factors = update(factors, values, params).newFactorsIndices;
  step.moved = back_substitute();
  step.relinearised = !above.empty();
  unchecked_.insert(unchecked_.end(), step.moved.begin(), step.moved.end());
  return step;
}

gtsam::KeySet ObservedIsam2::above_threshold() const {
  const auto& thresholds = boost::get<gtsam::FastMap<char, gtsam::Vector>>(params_.relinearizeThreshold);
  gtsam::KeySet above;
  for (const gtsam::Key key : unchecked_) {
    const gtsam::Vector& threshold = thresholds.at(static_cast<char>(gtsam::Symbol(key).chr()));
    if ((delta_.at(key).array().abs() > threshold.array()).any()) above.insert(key);
  }
  return above;
}

gtsam::FastList<gtsam::Key> ObservedIsam2::with_dependents(const gtsam::KeySet& keys) const {
  // The cliques that hold a variable are a subtree under the one where it is frontal.
  gtsam::KeySet found = keys;
  std::vector<sharedClique> open;
  for (const gtsam::Key key : keys) open.push_back(nodes_.at(key));
  std::unordered_set<const Clique*> seen;
  while (!open.empty()) {
    const sharedClique clique = std::move(open.back());
    open.pop_back();
    if (!seen.insert(clique.get()).second) continue;
    for (const sharedClique& child : clique->children) {
      const auto& conditional = *child->conditional();
      const bool depends = std::any_of(conditional.beginParents(), conditional.endParents(),
                                       [&](gtsam::Key key) { return keys.exists(key); });
      if (!depends) continue;
      found.insert(conditional.beginFrontals(), conditional.endFrontals());
      open.push_back(child);
    }
  }
  return gtsam::FastList<gtsam::Key>(found.begin(), found.end());
}

void ObservedIsam2::relinearise(const gtsam::KeySet& keys) {
  gtsam::FactorIndexSet touched;
  for (const gtsam::Key key : keys) {
    gtsam::Value* moved = theta_.at(key).retract_(delta_.at(key));
    theta_.update(key, *moved);
    moved->deallocate_();
    const gtsam::FactorIndices& factors = variableIndex_[key];
    touched.insert(factors.begin(), factors.end());
  }
  for (const std::size_t index : touched) {
    linearFactors_.replace(index, nonlinearFactors_.at(index)->linearize(theta_));
  }
}

gtsam::KeyVector ObservedIsam2::back_substitute() {
  const double threshold = boost::get<gtsam::ISAM2GaussNewtonParams>(params_.optimizationParams).wildfireThreshold;
  const std::unordered_set<gtsam::Key> replaced(deltaReplacedMask_.begin(), deltaReplacedMask_.end());
  std::unordered_set<gtsam::Key> changed;
  gtsam::KeyVector moved;
  // From the roots of the Bayes tree down to where nothing changes by more than the threshold.
  std::vector<sharedClique> open(roots_.begin(), roots_.end());
  while (!open.empty()) {
    const sharedClique clique = std::move(open.back());
    open.pop_back();
    const gtsam::GaussianConditional& conditional = *clique->conditional();
    // What was linearised or eliminated anew counts as changed in any case.
    const bool is_new = replaced.contains(conditional.firstFrontalKey());
    const bool depends = is_new || std::any_of(conditional.beginParents(), conditional.endParents(),
                                               [&](gtsam::Key key) { return changed.contains(key); });
    if (!depends) continue;
    open.insert(open.end(), clique->children.begin(), clique->children.end());
    if (is_new) shed_eliminated_rows(*clique);
    if (!solve(conditional, is_new ? 0.0 : threshold)) continue;
    changed.insert(conditional.beginFrontals(), conditional.endFrontals());
    moved.insert(moved.end(), conditional.beginFrontals(), conditional.endFrontals());
  }
  deltaReplacedMask_.clear();
  return moved;
}

bool ObservedIsam2::solve(const gtsam::GaussianConditional& conditional, double threshold) {
  gtsam::Vector solution = conditional.d();
  Eigen::Index column = 0;
  const auto S = conditional.S();
  for (auto key = conditional.beginParents(); key != conditional.endParents(); ++key) {
    const gtsam::Vector& parent = delta_.at(*key);
    solution.noalias() -= S.middleCols(column, parent.size()) * parent;
    column += parent.size();
  }
  conditional.R().triangularView<Eigen::Upper>().solveInPlace(solution);
  if (solution.hasNaN()) throw gtsam::IndeterminantLinearSystemException(conditional.firstFrontalKey());
  double change = 0.0;
  Eigen::Index row = 0;
  for (auto key = conditional.beginFrontals(); key != conditional.endFrontals(); ++key) {
    const gtsam::Vector& before = delta_.at(*key);
    change = std::max(change, (solution.segment(row, before.size()) - before).lpNorm<Eigen::Infinity>());
    row += before.size();
  }
  if (change < threshold) return false;
  row = 0;
  for (auto key = conditional.beginFrontals(); key != conditional.endFrontals(); ++key) {
    gtsam::Vector& value = delta_.at(*key);
    value = solution.segment(row, value.size());
    row += value.size();
  }
  return true;
}

}  // namespace ignis
