// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/linear/linearExceptions.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/Values.h>

#include <boost/unordered/unordered_flat_set.hpp>
#include <cmath>
#include <format>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "backend/solver/incremental_solver.h"
#include "backend/solver/isam2.h"

/// What the solver keeps beside iSAM2; for its own sources alone.
namespace ignis {

struct IncrementalSolver::Impl {
  static constexpr double kUnknownError = std::numeric_limits<double>::quiet_NaN();

  explicit Impl(Isam2Settings how) : params(std::move(how)), isam(params) {}

  [[nodiscard]] static std::string name_of(gtsam::Key key) { return std::string(gtsam::Symbol(key)); }

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
    for (const std::size_t index : isam.factors_of(key)) errors[id_of[index]] = kUnknownError;
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
  std::vector<double> errors;   ///< by FactorId: half chi-square at `values`, or kUnknownError
  std::vector<FactorId> id_of;  ///< by index in iSAM2
  gtsam::Values values;         ///< of each variable, the last solution that was asked for, or its first value
  gtsam::Values fixed;          ///< variables that are estimated no more
  boost::unordered_flat_set<gtsam::Key> stale;         ///< variables that iSAM2 has moved since
  std::vector<gtsam::Key> changed;                     ///< variables that it has moved since take_changed()
  boost::unordered_flat_set<gtsam::Key> relinearised;  ///< that it has linearised anew since take_relinearised()
  bool is_settled = false;                             ///< the last update linearised nothing anew
  int rebuilds = 0;
  std::string broken;  ///< why nothing is accepted any more; empty while all is well
};

}  // namespace ignis
