// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "backend/laps.h"

/// Row G1: one false loop that is as sure of itself as a surveyor's mark. What is published with it is held, after
/// every update, against what is published without it. Only a lie that the drift since the last true loop does not
/// explain can be told from the truth: here of 0.3 m among loops, and of 1.5 m without any for two laps.
namespace ignis {
namespace {

using testing::kLap;

constexpr int kKeyframes = 69;
constexpr int kNever = kKeyframes;
constexpr int kLoopEvery = 3;
constexpr int kKeyframesBehind = 8;  // twelve seconds
constexpr double kSigma = 1e-6;      // of the lie [m] and [rad]
constexpr double kMostMovedM = 0.10;
constexpr double kMostSeconds = 5.0;

/// Poses by id, as listeners of the updates hold them.
using Published = std::vector<Pose>;

void take(const SmootherUpdate& update, Published& published) {
  for (const KeyframePose& moved : update.moved) {
    published.resize(std::max(published.size(), static_cast<std::size_t>(moved.id) + 1));
    published[static_cast<std::size_t>(moved.id)] = moved.T_map_body;
  }
}

/// A drive of laps with true loops to the lap before, from keyframe `first_loop` on.
struct Laps {
  Laps(unsigned seed, int first)
      : drive(testing::make_drive({.seed = seed, .keyframes = kKeyframes})), first_loop(first) {
    Smoother smoother(testing::without_search(kKeyframes), LoopGates());
    Published published;
    for (const Keyframe& keyframe : drive.keyframes) {
      take(smoother.add_keyframe(keyframe), published);
      if (has_loop(keyframe.id)) take(smoother.add_loop(true_loop(keyframe.id)), published);
      without_lie.push_back(published);
    }
  }

  [[nodiscard]] bool has_loop(int id) const { return id >= first_loop && id % kLoopEvery == 0; }
  [[nodiscard]] LoopMeasurement true_loop(int id) const { return testing::loop_in(drive, id, id - kLap); }

  testing::Drive drive;
  int first_loop;
  std::vector<Published> without_lie;  ///< after each keyframe and its loop
};

/// The same with a lie behind keyframe `from`, and some keyframes more.
class LiedTo {
 public:
  LiedTo(const Laps& laps, int from, const Vector6d& off) : from_(from) {
    for (int id = 0; id <= from + kKeyframesBehind; ++id) {
      const Keyframe& keyframe = laps.drive.keyframes[static_cast<std::size_t>(id)];
      now_ = keyframe.state.utime;
      heed(smoother_.add_keyframe(keyframe));
      if (laps.has_loop(id)) heed(smoother_.add_loop(laps.true_loop(id)));
      if (id == from) {
        LoopMeasurement lie = testing::loop_in(laps.drive, from, to());
        lie.T_to_from = perturbed_in_body(lie.T_to_from, off);
        lie.information = Matrix6d::Identity() / (kSigma * kSigma);
        heed(smoother_.add_loop(lie));
      }
      compare(laps.without_lie[static_cast<std::size_t>(id)]);
    }
  }

  double moved_m = 0.0;      ///< largest distance of a published keyframe from where it is without the lie
  double believed_s = 0.0;   ///< for which the lie was in the graph
  bool is_believed = false;  ///< in the end

 private:
  [[nodiscard]] int to() const { return from_ - kLap - 1; }

  void heed(const SmootherUpdate& update) {
    take(update, published_);
    if (update.loop) heed(*update.loop);
    for (const LoopResult& changed : update.changed) heed(changed);
    if (is_believed && !since_) since_ = now_;
    if (since_) believed_s = seconds_between(*since_, now_);
    if (!is_believed) since_.reset();
  }

  void heed(const LoopResult& loop) {
    if (loop.from_id != from_ || loop.to_id != to()) return;
    is_believed = loop.stage == LoopStage::kOnTrial || loop.stage == LoopStage::kKept;
  }

  void compare(const Published& without_lie) {
    ASSERT_EQ(published_.size(), without_lie.size());
    for (std::size_t i = 0; i < published_.size(); ++i) {
      moved_m = std::max(moved_m, (published_[i].translation - without_lie[i].translation).norm());
    }
  }

  int from_;
  Smoother smoother_{testing::without_search(kKeyframes), LoopGates()};
  Published published_;
  Utime now_ = 0;
  std::optional<Utime> since_;  ///< when the lie entered the graph, while it is there
};

/// Ahead, up, to the side, and turned about the vertical.
std::vector<Vector6d> lies_of(double size_m) {
  std::vector<Vector6d> lies(4, Vector6d::Zero());
  for (int axis = 0; axis < 3; ++axis) lies[static_cast<std::size_t>(axis)](3 + axis) = size_m;
  lies[3](1) = 0.3 * size_m;
  return lies;
}

void expect_nothing_moves(const Laps& laps, int from, double size_m) {
  for (const Vector6d& off : lies_of(size_m)) {
    const LiedTo run(laps, from, off);
    EXPECT_LT(run.moved_m, kMostMovedM) << size_m << " m, keyframe " << from << ": " << off.transpose();
    EXPECT_LE(run.believed_s, kMostSeconds) << size_m << " m, keyframe " << from << ": " << off.transpose();
    EXPECT_FALSE(run.is_believed) << size_m << " m, keyframe " << from << ": " << off.transpose();
  }
}

TEST(Fault_G1, ASureLieAmongTrueLoopsMovesNothingThatIsPublished) {
  for (const unsigned seed : {1U, 3U}) {
    const Laps laps(seed, kLap);
    // Behind a true loop of the same keyframe, and a keyframe later.
    for (const int from : {30, 46, 60}) {
      for (const double size_m : {0.3, 1.2, 5.0}) expect_nothing_moves(laps, from, size_m);
    }
  }
}

TEST(Fault_G1, ASureLieThatDriftDoesNotExplainMovesNothingWhereNoOtherLoopIs) {
  const Laps laps(2, kNever);
  for (const double size_m : {1.5, 5.0}) expect_nothing_moves(laps, 46, size_m);
}

}  // namespace
}  // namespace ignis
