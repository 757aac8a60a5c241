// SPDX-License-Identifier: Apache-2.0
#include "drivers/value_checks.h"

#include <limits>

#include <gtest/gtest.h>

#include "drivers/l1_samples.h"

namespace ignis::l1 {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

TEST(ValueChecks, PassWhatASensorSends) {
  EXPECT_EQ(fault_in(samples::auxiliary(1), {}), "");
  EXPECT_EQ(fault_in(samples::distance(1), {}), "");
  EXPECT_EQ(fault_in(samples::imu(1), {}), "");
}

TEST(ValueChecks, RefuseEveryNonFiniteFieldOfAux) {
  float Auxiliary::* const fields[] = {&Auxiliary::yaw_start_deg,
                                       &Auxiliary::yaw_step_deg,
                                       &Auxiliary::vertical_start_deg,
                                       &Auxiliary::vertical_step_deg,
                                       &Auxiliary::apd_temperature,
                                       &Auxiliary::dirty_index,
                                       &Auxiliary::imu_temperature,
                                       &Auxiliary::up_optical_q,
                                       &Auxiliary::down_optical_q,
                                       &Auxiliary::apd_voltage,
                                       &Auxiliary::b_axis_mm,
                                       &Auxiliary::theta_rad,
                                       &Auxiliary::ksi_rad};
  for (const auto field : fields) {
    for (const float bad : {kNan, kInf, -kInf}) {
      Auxiliary message = samples::auxiliary(1);
      message.*field = bad;
      EXPECT_NE(fault_in(message, {}), "");
    }
  }
  Auxiliary message = samples::auxiliary(1);
  message.imu_angle_offset[2] = kNan;
  EXPECT_NE(fault_in(message, {}), "");
}

TEST(ValueChecks, RefuseAbsurdGeometry) {
  const std::pair<float Auxiliary::*, float> cases[] = {{&Auxiliary::yaw_start_deg, 1e6F},
                                                        {&Auxiliary::yaw_step_deg, 400.0F},
                                                        {&Auxiliary::vertical_start_deg, -1e4F},
                                                        {&Auxiliary::vertical_step_deg, 9.0F},
                                                        {&Auxiliary::b_axis_mm, 1e3F},
                                                        {&Auxiliary::theta_rad, 1.0F},
                                                        {&Auxiliary::ksi_rad, -1.0F}};
  for (const auto& [field, value] : cases) {
    Auxiliary message = samples::auxiliary(1);
    message.*field = value;
    EXPECT_NE(fault_in(message, {}), "");
  }
}

TEST(ValueChecks, RefuseAWrongPointCountUnlessToldNotTo) {
  Auxiliary angles = samples::auxiliary(1);
  angles.payload_size = 119;
  Distance ranges = samples::distance(1);
  ranges.payload_size = 242;
  EXPECT_EQ(fault_in(angles, {}), "AUX payload_size");
  EXPECT_EQ(fault_in(ranges, {}), "DISTANCE payload_size");
  DriverConfig lenient;
  lenient.check_payload_size = false;
  EXPECT_EQ(fault_in(angles, lenient), "");
  EXPECT_EQ(fault_in(ranges, lenient), "");
}

TEST(ValueChecks, RefuseImpossibleInertialValues) {
  for (const float bad : {kNan, kInf, 1e28F, -1e28F}) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      ImuAttitude gyro = samples::imu(1);
      gyro.gyro[axis] = bad;
      EXPECT_EQ(fault_in(gyro, {}), "angular_velocity");
      ImuAttitude accel = samples::imu(1);
      accel.accel[axis] = bad;
      EXPECT_EQ(fault_in(accel, {}), "linear_acceleration");
    }
  }
  ImuAttitude zero = samples::imu(1);
  zero.quaternion = {};
  EXPECT_EQ(fault_in(zero, {}), "quaternion");
  zero.quaternion = {kNan, 0.0F, 0.0F, 0.0F};
  EXPECT_EQ(fault_in(zero, {}), "quaternion");
}

TEST(ValueChecks, SeeSaturationAtFullScale) {
  const DriverConfig config;
  ImuAttitude message = samples::imu(1);
  EXPECT_FALSE(is_saturated(message, config));
  message.gyro[1] = -static_cast<float>(config.gyro_limit_rad_s);
  EXPECT_TRUE(is_saturated(message, config));
  EXPECT_EQ(fault_in(message, config), "");
  message = samples::imu(1);
  message.accel[0] = static_cast<float>(config.accel_limit_m_s2);
  EXPECT_TRUE(is_saturated(message, config));
  EXPECT_EQ(fault_in(message, config), "");
}

}  // namespace
}  // namespace ignis::l1
