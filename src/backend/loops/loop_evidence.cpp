// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_evidence.h"

#include <Eigen/Cholesky>

namespace ignis {
namespace {

// A measurement that nothing else checks has leverage 1: its cost cannot be told.
constexpr double kSmallestFreedom = 1e-6;

Eigen::Index first_row(std::size_t i) { return 6 * static_cast<Eigen::Index>(i); }

}  // namespace

Matrix6d LoopEvidence::covariance(std::size_t i) const { return covariance_.block<6, 6>(first_row(i), first_row(i)); }

Eigen::MatrixXd LoopEvidence::innovation(std::size_t i) const {
  const WhiteningRows& rows = parts_[i].rows;
  const Eigen::MatrixXd whitened = rows * covariance(i) * rows.transpose();
  const Eigen::MatrixXd unit = (1.0 + kSmallestFreedom) * Eigen::MatrixXd::Identity(rows.rows(), rows.rows());
  return parts_[i].is_in ? Eigen::MatrixXd(unit - whitened) : Eigen::MatrixXd(unit + whitened);
}

double LoopEvidence::cost(std::size_t i) const {
  const Eigen::VectorXd error = parts_[i].rows * error_.segment<6>(first_row(i));
  return error.dot(innovation(i).ldlt().solve(error));
}

void LoopEvidence::move(std::size_t i) {
  Part& part = parts_[i];
  const Eigen::MatrixXd with_all = part.rows * covariance_.middleRows<6>(first_row(i));
  const double sign = part.is_in ? 1.0 : -1.0;
  const Eigen::MatrixXd gain = sign * innovation(i).ldlt().solve(with_all).transpose();
  const Eigen::VectorXd own_error = part.rows * error_.segment<6>(first_row(i));
  error_ += gain * own_error;
  covariance_ += gain * with_all;
  part.is_in = !part.is_in;
}

}  // namespace ignis
