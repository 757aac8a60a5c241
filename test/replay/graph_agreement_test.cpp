// SPDX-License-Identifier: Apache-2.0
#include "graph_agreement.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "backend/synthetic_drive.h"
#include "messages/graph_messages.h"
#include "messages/graph_revision.h"
#include "messages/keyframe_messages.h"
#include "messages/odometry_messages.h"

namespace ignis {
namespace {

BackendConfig without_search() {
  BackendConfig config;
  config.use_loop_closing = false;
  return config;
}

/// Runs a smoother over a drive and tells every listener what would be published.
void run(const std::vector<Keyframe>& keyframes, const std::vector<GraphListener*>& listeners) {
  Smoother smoother(without_search(), LoopGates{});
  for (const Keyframe& keyframe : keyframes) {
    for (const keyframe_t& part : messages::to_messages(keyframe)) {
      for (GraphListener* listener : listeners) listener->keyframe_sent(part);
    }
    const SmootherUpdate update = smoother.add_keyframe(keyframe);
    ASSERT_TRUE(update.accepted()) << update.reason;
    for (GraphListener* listener : listeners) listener->graph_changed(smoother, update, 0, keyframe.state.utime);
  }
}

/// What live processes would have left in a log: encoded messages that outlive their views.
class LiveRun : public GraphListener {
 public:
  void keyframe_sent(const keyframe_t& part) override { keep(part, keyframes); }

  void graph_changed(const Smoother& smoother, const SmootherUpdate& update, std::int32_t session,
                     Utime utime) override {
    messages::GraphRevision revision = messages::revision_of(smoother, update, session, utime);
    for (const auto& part : messages::to_messages(revision)) keep(part, revisions);
    if (++updates_ % 3 == 0) {
      messages::list_all(revision, smoother);
      for (const auto& part : messages::to_messages(revision)) keep(part, revisions);
    }
    if (update.loop) keep(messages::to_message(*update.loop, session), loops);
    NavState state = update.newest;
    state.utime = utime + 1000;
    keep(messages::to_message(state, session, "odom"), states);
    keep(messages::smoothed_state(state, session, update.T_map_odom), smoothed_states);
  }

  [[nodiscard]] RecordedResults recorded() const {
    return {.scan_stats = {},
            .keyframes = {keyframes.begin(), keyframes.end()},
            .states = {states.begin(), states.end()},
            .revisions = {revisions.begin(), revisions.end()},
            .smoothed_states = {smoothed_states.begin(), smoothed_states.end()},
            .loops = {loops.begin(), loops.end()},
            .first_session = {},
            .first_command = {}};
  }

  using Buffers = std::vector<std::vector<std::byte>>;
  Buffers keyframes, states, revisions, smoothed_states, loops;

 private:
  template <class Message>
  void keep(Message message, Buffers& list) {
    message.sequence = static_cast<std::int32_t>(list.size());
    list.push_back(encoded(message));
  }
  int updates_ = 0;
};

constexpr Utime kEnd = std::numeric_limits<Utime>::max();

/// Alters the last byte of the last number of a message.
void spoil(std::vector<std::byte>& message) { message.back() ^= std::byte{1}; }

class GraphAgreementTest : public ::testing::Test {
 protected:
  GraphAgreementTest() { run(drive_.keyframes, {&live_}); }

  [[nodiscard]] GraphAgreement compared(const std::vector<Keyframe>& replayed) const {
    const RecordedResults recorded = live_.recorded();
    GraphComparison comparison(recorded);
    run(replayed, {&comparison});
    return comparison.agreement(kEnd);
  }

  testing::Drive drive_ = testing::make_drive({.seed = 5, .keyframes = 9});
  LiveRun live_;
};

TEST_F(GraphAgreementTest, IsCompleteWhenTheSameIsPublished) {
  const GraphAgreement agreement = compared(drive_.keyframes);
  EXPECT_TRUE(agreement.complete());
  EXPECT_EQ(agreement.keyframes.recorded, 9);
  EXPECT_EQ(agreement.revisions.recorded, 9 + 3) << "three full sets";
  EXPECT_EQ(agreement.loops.recorded, 9);
  EXPECT_EQ(agreement.smoothed_states.recorded, 9);
  EXPECT_FALSE(agreement.revisions.first_unequal);
}

TEST_F(GraphAgreementTest, SeesOneBitOfEachChannel) {
  spoil(live_.keyframes[2]);
  spoil(live_.revisions[4]);
  spoil(live_.loops[5]);
  constexpr std::size_t kPositionEnd = 8 + 8 + 4 + 4 + 4 + 4 + 8;  // fingerprint to position[0]
  live_.smoothed_states[6][kPositionEnd - 1] ^= std::byte{1};
  const GraphAgreement agreement = compared(drive_.keyframes);
  EXPECT_FALSE(agreement.complete());
  EXPECT_EQ(agreement.keyframes.equal, 8);
  EXPECT_EQ(agreement.keyframes.first_unequal, drive_.keyframes[2].state.utime);
  EXPECT_EQ(agreement.revisions.equal, 11);
  EXPECT_EQ(agreement.loops.equal, 8);
  EXPECT_EQ(agreement.loops.first_unequal, drive_.keyframes[5].state.utime);
  EXPECT_EQ(agreement.smoothed_states.equal, 8);
  EXPECT_EQ(agreement.smoothed_states.first_unequal, drive_.keyframes[6].state.utime + 1000);
}

TEST_F(GraphAgreementTest, ComparesFullSetsWithTheGraphOfTheirRevision) {
  spoil(live_.revisions[3]);  // the first full set
  const GraphAgreement agreement = compared(drive_.keyframes);
  EXPECT_EQ(agreement.revisions.equal, 11);
  EXPECT_EQ(agreement.revisions.first_unequal, drive_.keyframes[2].state.utime);
}

TEST_F(GraphAgreementTest, FindsWhereAnotherGraphDeparts) {
  std::vector<Keyframe> other = drive_.keyframes;
  double& x = other[5].state.T_odom_body.translation.x();
  x = std::nextafter(x, 10.0);
  const GraphAgreement agreement = compared(other);
  EXPECT_EQ(agreement.keyframes.equal, 8);
  EXPECT_LT(agreement.revisions.equal, agreement.revisions.recorded);
  EXPECT_EQ(agreement.revisions.first_unequal, other[5].state.utime);
  EXPECT_EQ(agreement.smoothed_states.first_unequal, other[5].state.utime + 1000);
}

TEST_F(GraphAgreementTest, CountsWhatTheReplayDoesNotHave) {
  const GraphAgreement agreement = compared({drive_.keyframes.begin(), drive_.keyframes.end() - 2});
  EXPECT_EQ(agreement.keyframes.recorded, 9);
  EXPECT_EQ(agreement.keyframes.equal, 7);
  EXPECT_EQ(agreement.loops.equal, 7);
}

TEST_F(GraphAgreementTest, LooksNoFurtherThanTheReplayWent) {
  const RecordedResults recorded = live_.recorded();
  GraphComparison comparison(recorded);
  run({drive_.keyframes.begin(), drive_.keyframes.begin() + 4}, {&comparison});
  const GraphAgreement agreement = comparison.agreement(drive_.keyframes[3].state.utime + 1000);
  EXPECT_TRUE(agreement.complete());
  EXPECT_EQ(agreement.keyframes.recorded, 4);
  EXPECT_EQ(agreement.smoothed_states.recorded, 4);
}

TEST_F(GraphAgreementTest, AStateMayCarryAnEarlierCorrectionAndNeedsItsOdometry) {
  state_t state;
  ASSERT_TRUE(messages::decode_checked(live_.states[6], state));
  const Pose early{Eigen::Quaterniond::Identity(), Eigen::Vector3d(50.0, 0.0, 0.0)};
  live_.smoothed_states[6] = encoded(messages::smoothed_state(messages::from_message(state), 0, early));
  live_.states[7].clear();  // lost by the recorder
  const GraphAgreement agreement = compared(drive_.keyframes);
  EXPECT_EQ(agreement.smoothed_states.recorded, 8);
  EXPECT_EQ(agreement.smoothed_states.first_unequal, state.utime) << "no revision has moved it so far";
  live_.smoothed_states[6] = encoded(messages::smoothed_state(messages::from_message(state), 0, Pose{}));
  EXPECT_EQ(compared(drive_.keyframes).smoothed_states.equal, 8) << "a back end that has no keyframe yet";
}

TEST(RecordedResults, NotesWhenSomebodyTookALoopOut) {
  RecordedResults results;
  graph_command_t command{};
  command.command = graph_command_t::SEND_FULL_SET;
  const std::vector<std::byte> harmless = encoded(command);
  results.add({.number = 0, .log_utime = 5, .channel = "GRAPH_COMMAND", .data = harmless});
  EXPECT_FALSE(results.first_command);
  command.command = graph_command_t::VETO_LOOP;
  const std::vector<std::byte> veto = encoded(command);
  results.add({.number = 1, .log_utime = 6, .channel = "GRAPH_COMMAND", .data = veto});
  results.add({.number = 2, .log_utime = 7, .channel = "GRAPH_COMMAND", .data = veto});
  EXPECT_EQ(results.first_command, 6);
}

}  // namespace
}  // namespace ignis
