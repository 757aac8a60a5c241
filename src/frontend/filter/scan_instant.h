// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/measurements.h"
#include "frontend/filter/eskf.h"

/// The instant that a scan measures.
///
/// A point is carried to the scan's end with the predicted velocity, so an error of that velocity shifts the scan. In
/// the mean over its points the scan measures the position at their mean instant, d before the end: with dp and dv the
/// errors of position and velocity at the end, it sees dp - d dv. Without this a velocity that is off by 1 m/s places
/// an L1 scan 25 mm wrong, and the update takes that for an exact position.
namespace ignis {

/// Seconds from the mean instant of a scan's points to its end; zero for a scan without points.
[[nodiscard]] double mean_age(const Scan& scan);

/// Whether a scan that lasts has all of its points, two and more, at one instant.
[[nodiscard]] bool is_of_one_instant(const Scan& scan);

/// The scan. When all of its points seem to be of its beginning they carry no times, and count as of its end, where
/// they need not be moved.
[[nodiscard]] Scan with_times(Scan scan);

/// Variance [rad^2], per axis, of the turn that the gyro's noise adds between the instants of a scan's points, in their
/// mean, and its end. The points are carried to the end by that turn, so scan matching does not see it: the attitude
/// that it finds is that of the mean instant, as the gyro has carried it on. New in each scan, so a map, which is a
/// mean of many, hardly has it. `gyro_noise` [rad/s/sqrt(Hz)]; points evenly spread over `seconds`.
[[nodiscard]] double unseen_turn_variance(double gyro_noise, double seconds);

/// Variance of the velocity [m^2/s^2], sum over the axes.
[[nodiscard]] double velocity_variance(const ErrorCovariance& covariance);

/// Share of the velocity's variance that has come since the map was made, from 0 to 1. The map's scans were shifted by
/// the error that the velocity had then, so that part cancels; only the new one moves a scan against the map.
[[nodiscard]] double new_share(const ErrorCovariance& covariance, double mapped_velocity_variance);

/// The covariance with the position error, dp, replaced by dp + seconds * dv. Negative seconds lead to an earlier
/// instant and undo positive ones.
[[nodiscard]] ErrorCovariance with_position_at(const ErrorCovariance& covariance, double seconds);

}  // namespace ignis
