// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <future>
#include <map>
#include <optional>

#include "map/live_map.h"
#include "map/picture_builder.h"
#include "map_builder/event_feed.h"
#include "map_builder/hud.h"
#include "map_builder/keyframe_requests.h"
#include "map_builder/lasting_map.h"
#include "map_builder/loop_table.h"
#include "map_builder/missed_scans.h"
#include "map_builder/process_table.h"
#include "map_builder/view_server.h"
#include "messages/graph_messages.h"
#include "messages/keyframe_messages.h"
#include "messages/odometry_messages.h"
#include "runtime/lcm_link.h"
#include "runtime/recent_rise.h"

namespace ignis {

/// The map_builder process: bus in, map and view out. The caller's thread handles messages and owns the map; the server
/// has its own thread, and so has a rebuild, whose result is taken over between two messages.
class MapProcess {
 public:
  /// `journal_folder` may be empty: then a killed process begins with the keyframes alone.
  MapProcess(const runtime::Application& application, const runtime::HmiConfig& hmi,
             const std::filesystem::path& journal_folder);

  /// Serves until a stop is requested.
  void run();

  [[nodiscard]] const LiveMap& map() const { return map_; }
  [[nodiscard]] std::string address() const { return server_.address(); }

 private:
  using Clock = std::chrono::steady_clock;

  void subscribe(const runtime::LcmConfig& lcm);
  [[nodiscard]] bool accept_session(std::int32_t session);
  void begin_session(std::int32_t session);
  [[nodiscard]] bool refuse_pose(const Pose& pose);
  [[nodiscard]] std::string trouble();
  void on_cloud(const messages::PosedCloud& cloud);
  void on_cloud_again(const messages::PosedCloud& cloud);
  void insert(const messages::PosedCloud& cloud);
  void insert(const Keyframe& keyframe);
  void catch_up();
  void on_keyframe(const Keyframe& keyframe);
  void on_revision(const messages::GraphRevision& revision);
  void on_loop(const loop_result_t& loop);
  void on_scan_stats(const scan_stats_t& scan);
  void on_state(const state_t& state);
  void on_health(const health_t& health);

  void start_or_finish_rebuild();
  void answer_viewers();
  void answer_clouds(std::int64_t viewer, const LoopCloudsRequest& request);
  void send_command(std::int64_t viewer, const LoopCommandRequest& request);
  void make_pictures();
  void refresh_paths();
  void publish_news(ViewUpdate update);
  void send_hud();
  void report();
  void request_missing_keyframes();
  void request(const char* channel, std::vector<std::int32_t> ids);
  void update_status();

  MapConfig map_config_;
  runtime::LcmLink link_;
  ViewServer server_;
  LastingMap lasting_;
  LiveMap& map_ = lasting_.live();
  MissedScans missed_;
  messages::CloudAssembler clouds_;
  messages::CloudAssembler clouds_again_;
  messages::KeyframeAssembler keyframes_;
  messages::RevisionAssembler revisions_;
  std::vector<const runtime::ReceiverCounts*> receivers_;
  runtime::ReceiverCounts* keyframe_counts_ = nullptr;
  HudData hud_;
  MapBudget budget_;
  EventFeed events_;
  LoopTable loops_;
  ProcessTable processes_;
  Clock::time_point last_state_{};
  Clock::duration frame_period_;
  std::optional<std::int32_t> session_;
  int resets_ = 0;
  bool map_changed_ = true;
  bool loops_changed_ = true;
  bool keyframes_changed_ = true;
  // Pictures share these until they change.
  SharedPath odometry_path_;
  SharedPath corrected_path_;
  SharedLoopEdges loop_edges_;
  Clock::time_point next_paths_{};
  std::map<double, PictureBuilder> builders_;  // by view radius [m], as are the pictures
  std::map<double, SharedPicture> pictures_;
  std::int64_t picture_number_ = 0;
  std::string journal_damage_;
  double journal_damage_s_ = 0.0;      // when it was found
  std::int64_t refused_messages_ = 0;  // with a pose that no map can hold
  runtime::RecentRise refusals_;
  runtime::RecentRise other_sessions_;
  runtime::RecentRise given_up_;
  runtime::RecentRise drops_;
  std::int64_t given_up_told_ = 0;  // in the log, whenever it has doubled
  std::int32_t graph_keyframes_ = 0;
  KeyframeRequests keyframe_requests_;
  std::int32_t request_sequence_ = 0;
  std::int32_t command_sequence_ = 0;
  struct Rebuilt {
    ThreeLevelMap map;
    int keyframes;
    double milliseconds;
  };
  // Last, so that a rebuild under way has ended before anything else goes.
  std::future<Rebuilt> rebuild_;
};

}  // namespace ignis
