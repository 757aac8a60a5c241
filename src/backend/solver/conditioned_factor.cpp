// SPDX-License-Identifier: Apache-2.0
#include "backend/solver/conditioned_factor.h"

#include <gtsam/linear/JacobianFactor.h>
#include <gtsam/nonlinear/NonlinearFactor.h>
#include <gtsam/nonlinear/Values.h>

#include <utility>
#include <vector>

namespace ignis {
namespace {

class ConditionedFactor : public gtsam::NonlinearFactor {
 public:
  ConditionedFactor(gtsam::NonlinearFactor::shared_ptr inner, gtsam::Values known, const gtsam::KeyVector& open)
      : NonlinearFactor(open), inner_(std::move(inner)), known_(std::move(known)) {}

  gtsam::NonlinearFactor::shared_ptr clone() const override { return boost::make_shared<ConditionedFactor>(*this); }

  double error(const gtsam::Values& values) const override { return inner_->error(with_known(values)); }
  std::size_t dim() const override { return inner_->dim(); }

  /// What is known does not move, so its columns have nothing to multiply.
  gtsam::GaussianFactor::shared_ptr linearize(const gtsam::Values& values) const override {
    const auto rows = boost::dynamic_pointer_cast<gtsam::JacobianFactor>(inner_->linearize(with_known(values)));
    std::vector<std::pair<gtsam::Key, gtsam::Matrix>> terms;
    for (auto key = rows->begin(); key != rows->end(); ++key) {
      if (!known_.exists(*key)) terms.emplace_back(*key, rows->getA(key));
    }
    return boost::make_shared<gtsam::JacobianFactor>(terms, rows->getb(), rows->get_model());
  }

 private:
  [[nodiscard]] gtsam::Values with_known(const gtsam::Values& values) const {
    gtsam::Values all = known_;
    for (const gtsam::Key key : keys()) all.insert(key, values.at(key));
    return all;
  }

  gtsam::NonlinearFactor::shared_ptr inner_;
  gtsam::Values known_;
};

}  // namespace

boost::shared_ptr<gtsam::NonlinearFactor> conditioned(const boost::shared_ptr<gtsam::NonlinearFactor>& factor,
                                                      const gtsam::Values& known) {
  gtsam::Values held;
  gtsam::KeyVector open;
  for (const gtsam::Key key : factor->keys()) {
    if (known.exists(key)) {
      held.insert(key, known.at(key));
    } else {
      open.push_back(key);
    }
  }
  if (held.empty()) return factor;
  if (open.empty()) return nullptr;
  return boost::make_shared<ConditionedFactor>(factor, std::move(held), open);
}

}  // namespace ignis
