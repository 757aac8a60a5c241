// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/mover.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "drivers/sim/ray_scene.h"
#include "drivers/sim/sim_rooms.h"

namespace ignis::sim {
namespace {

/// A truck with its mast in front: the nose tells where it faces.
std::vector<Solid> truck() {
  return {{Solid::Shape::kBox, Eigen::Matrix3d::Identity(), {0, 1, 0}, {0.5, 1, 1}, 0.5},
          {Solid::Shape::kBox, Eigen::Matrix3d::Identity(), {0, 1, -1.5}, {0.1, 0.1, 0.5}, 0.9}};
}

Eigen::Vector3d place(const Mover& mover, double time) { return mover.T_world_mover(time).translation; }

Eigen::Vector3d nose(const Mover& mover, double time) {
  return mover.T_world_mover(time).rotation * -Eigen::Vector3d::UnitZ();
}

TEST(Mover, WaitsGoesRestsAndStaysAtItsEnd) {
  const Mover mover(truck(), {{{0, 0, 0}, 0.0}, {{4, 0, 0}, 3.0}, {{4, 0, -6}, 0.0}}, 2.0, 10.0, false);
  EXPECT_EQ(place(mover, 0.0), Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(place(mover, 10.0), Eigen::Vector3d(0, 0, 0));
  EXPECT_LT((place(mover, 11.5) - Eigen::Vector3d(3, 0, 0)).norm(), 1e-12);
  EXPECT_LT((place(mover, 12.1) - Eigen::Vector3d(4, 0, 0)).norm(), 1e-12) << "rests";
  EXPECT_LT((place(mover, 14.9) - Eigen::Vector3d(4, 0, 0)).norm(), 1e-12) << "rests";
  EXPECT_LT((place(mover, 16.0) - Eigen::Vector3d(4, 0, -2)).norm(), 1e-12);
  EXPECT_LT((place(mover, 500.0) - Eigen::Vector3d(4, 0, -6)).norm(), 1e-12);
}

TEST(Mover, RepeatsItsLoopForEver) {
  const Mover mover(truck(), {{{0, 0, 0}, 1.0}, {{5, 0, 0}, 0.0}, {{5, 0, -5}, 2.0}}, 1.0, 3.0, true);
  const double period = 1.0 + 5.0 + 5.0 + 2.0 + std::sqrt(50.0);
  for (double t = 3.0; t < 3.0 + period; t += 0.37) {
    EXPECT_LT((place(mover, t + 4.0 * period) - place(mover, t)).norm(), 1e-9) << t;
  }
  EXPECT_LT((place(mover, 3.0 + period - 1.0) - Eigen::Vector3d(1, 0, -1) / std::sqrt(2.0)).norm(), 1e-9);
}

TEST(Mover, FacesWhereItGoes) {
  const Mover mover(truck(), {{{0, 0, 0}, 0.0}, {{4, 0, 0}, 0.0}, {{4, 0, 4}, 0.0}}, 1.0, 0.0, false);
  EXPECT_LT((nose(mover, 1.0) - Eigen::Vector3d(1, 0, 0)).norm(), 1e-12);
  EXPECT_LT((nose(mover, 5.0) - Eigen::Vector3d(0, 0, 1)).norm(), 1e-12);
  EXPECT_LT((nose(mover, 50.0) - Eigen::Vector3d(0, 0, 1)).norm(), 1e-12) << "keeps its heading at the end";
}

TEST(Mover, IsHitWhereItIsAtTheInstantOfTheRay) {
  const Mover mover(truck(), {{{0, 0, -20}, 0.0}, {{0, 0, -4}, 0.0}}, 2.0, 0.0, false);
  const Ray ahead{{0, 1, 0}, {0, 0, -1}};
  // The mast points at the sensor, two metres before the origin of the truck.
  for (const double time : {0.0, 1.25, 4.0, 8.0, 20.0}) {
    const std::optional<Hit> hit = mover.cast(ahead, 50.0, time);
    ASSERT_TRUE(hit) << time;
    EXPECT_NEAR(hit->distance, 18.0 - 2.0 * std::min(time, 8.0), 1e-12);
    EXPECT_LT((hit->normal - Eigen::Vector3d(0, 0, 1)).norm(), 1e-12);
    EXPECT_DOUBLE_EQ(hit->reflectivity, 0.9);
    EXPECT_NEAR(mover.clearance(ahead.origin, time), hit->distance, 1e-12);
  }
  EXPECT_FALSE(mover.cast(ahead, 17.9, 0.0));
  EXPECT_FALSE(mover.cast({{0, 1, 0}, {1, 0, 0}}, 50.0, 0.0));
}

TEST(MovingScene, ShowsWhatMovesBeforeWhatStands) {
  const Solid wall{Solid::Shape::kBox, Eigen::Matrix3d::Identity(), {0, 0, -10}, {5, 5, 0.5}, 0.3};
  const RayScene scene({}, {wall}, {}, {Mover(truck(), {{{-10, 0, -5}, 0.0}, {{10, 0, -5}, 0.0}}, 1.0, 0.0, false)});
  const Ray ahead{{0, 1, 0}, {0, 0, -1}};
  EXPECT_NEAR(scene.cast(ahead, 50.0, 0.0)->distance, 9.5, 1e-12);
  EXPECT_NEAR(scene.cast(ahead, 50.0, 10.0)->distance, 4.5, 1e-12);
  EXPECT_NEAR(scene.cast(ahead, 50.0, 20.0)->distance, 9.5, 1e-12);
  EXPECT_NEAR(scene.clearance({0, 1, 0}, 10.0), 4.5, 1e-12);
}

/// Returns of the sensor from t to t + 0.5 s when all there is to see is one wall-sized mover.
int returns_at(double begin_s) {
  SceneConfig scene;
  scene.trajectory.waypoints = {{.position_m = {0, 0.6, 0}, .rest_s = 10.0}, {.position_m = {0, 0.6, -5}}};
  scene.movers.push_back({.speed_m_s = 20.0,
                          .start_s = 2.0,
                          .loop = false,
                          .waypoints = {{{0, 0, -100}, 0.0}, {{0, 0, -12}, 0.0}},
                          .boxes = {{.center_m = {0, 5, 0}, .size_m = {20, 10, 1}}}});
  int returns = 0;
  for (const StreamFrame& frame : frames_of(scene, 1, begin_s + 0.5)) {
    if (frame.message_id != l1::kDistanceId || static_cast<double>(frame.measured_utime) < begin_s * 1e6) continue;
    const l1::Distance packet = l1::decode_distance(payload_of(frame));
    returns += static_cast<int>(std::ranges::count_if(packet.ranges_mm, [](auto range) { return range > 0; }));
  }
  return returns;
}

TEST(MovingScene, IsSeenByTheSensorAtTheInstantOfEachPoint) {
  EXPECT_EQ(returns_at(1.0), 0) << "it is still 100 m away";
  EXPECT_GT(returns_at(8.0), 1000) << "it has arrived";
}

}  // namespace
}  // namespace ignis::sim
