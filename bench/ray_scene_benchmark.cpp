// SPDX-License-Identifier: Apache-2.0
//
// Rays per second of the simulator's scenes, cast as the L1 casts them: along the drive, over the sensor's hemisphere.
// The L1 itself asks for 21,600 rays per second of drive.

#include <filesystem>
#include <numbers>
#include <random>

#include <benchmark/benchmark.h>

#include "drivers/sim/scene_config.h"

namespace ignis::sim {
namespace {

constexpr double kLimit = 21.0;
constexpr std::size_t kRays = 50000;

struct TimedRay {
  Ray ray;
  double time;
};

/// Directions of a hemisphere that leans 45 degrees forward, from where the drive is at random instants.
std::vector<TimedRay> rays_along(const Trajectory& drive) {
  std::mt19937 engine(1);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> instant(0.0, drive.duration());
  const Eigen::Vector3d axis_body(0.0, std::numbers::sqrt2 / 2.0, -std::numbers::sqrt2 / 2.0);
  std::vector<TimedRay> rays;
  while (rays.size() < kRays) {
    const double time = instant(engine);
    const double x = normal(engine);
    const double y = normal(engine);
    Eigen::Vector3d direction = Eigen::Vector3d(x, y, normal(engine)).normalized();
    const Pose T_world_body = drive.at(time).T_world_body;
    if (direction.dot(T_world_body.rotation * axis_body) < 0.0) direction = -direction;
    rays.push_back({{T_world_body.translation, direction}, time});
  }
  return rays;
}

void cast_rays(benchmark::State& state, const std::string& file) {
  const SceneConfig config = load_scene(std::filesystem::path(IGNIS_CONFIG_DIR) / "scenes" / file);
  const RayScene scene = make_ray_scene(config);
  const std::vector<TimedRay> rays = rays_along(Trajectory(config.trajectory));
  std::size_t next = 0;
  for (auto _ : state) {
    const TimedRay& timed = rays[next];
    benchmark::DoNotOptimize(scene.cast(timed.ray, kLimit, timed.time));
    next = next + 1 < kRays ? next + 1 : 0;
  }
  state.SetItemsProcessed(state.iterations());
}

BENCHMARK_CAPTURE(cast_rays, battery_hall, std::string("battery_hall.json"));
BENCHMARK_CAPTURE(cast_rays, hall_with_forklifts, std::string("hall_with_forklifts.json"));
BENCHMARK_CAPTURE(cast_rays, open_hall_bare, std::string("open_hall_bare.json"));
BENCHMARK_CAPTURE(cast_rays, rock_tunnel_mesh, std::string("rock_tunnel.json"));
BENCHMARK_CAPTURE(cast_rays, warehouse, std::string("warehouse.json"));

}  // namespace
}  // namespace ignis::sim
