// The contract of HandDriver, first half: what commands do.
#include <cmath>
#include <limits>

#include "tests/contract/hand_contract.hpp"
#include "tests/support/heap_counter.hpp"

namespace embody::test {
namespace {

using std::chrono::milliseconds;
using transport::now;

TEST_P(HandContract, ConnectingMovesNothingAndTellsWhatIsThere) {
  const auto before = cell_->motors();
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_GE(info_.fd, 0);
  EXPECT_GT(info_.rate_hz, 0.0);
  expect_sentence(info_.peer.view());
  ASSERT_EQ(info_.joint_count, cell_->near_rad.size());
  for (std::size_t i = 0; i < info_.joint_count; ++i) EXPECT_FALSE(info_.joint_names[i].empty());
  EXPECT_TRUE(hand_->reason().empty());
  hold_for(milliseconds(300));
  EXPECT_EQ(cell_->motions(), 0U);
  EXPECT_TRUE(is_at(before));
}

TEST_P(HandContract, AnExpiredMotionIsRefusedAndAFreshOneGoes) {
  ASSERT_NO_FATAL_FAILURE(open());
  hold_for(milliseconds(100));
  const auto before = cell_->motors();
  const auto late = [&] {
    HandCommand command = move(cell_->far_rad);
    command.t_expires = now() - milliseconds(1);
    return command;
  };
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(hand_->write(late(), now()), IoStatus::kRefused);
    for (int turns = 0; turns < 5; ++turns) ASSERT_NE(turn(), IoStatus::kDisconnected) << hand_->reason();
  }
  HandCommand never;  // a command that nobody has given a time
  never.action = HandAction::kMove;
  never.joint_count = cell_->far_rad.size();
  EXPECT_EQ(hand_->write(never, now()), IoStatus::kRefused);
  hold_for(milliseconds(200));
  EXPECT_EQ(cell_->motions(), 0U);
  EXPECT_TRUE(is_at(before));
  EXPECT_TRUE(reach(cell_->near_rad, cell_->near_units)) << hand_->reason();
  EXPECT_GT(cell_->motions(), 0U);
}

TEST_P(HandContract, TargetsThatAreNoNumbersOrTooManyAreRefused) {
  ASSERT_NO_FATAL_FAILURE(open());
  hold_for(milliseconds(100));
  const auto before = cell_->motors();
  const std::size_t joints = cell_->far_rad.size();
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), -HUGE_VAL}) {
    for (std::size_t i = 0; i < joints; ++i) {
      HandCommand command = move(cell_->far_rad);
      command.q_rad[i] = bad;
      EXPECT_EQ(hand_->write(command, now()), IoStatus::kRefused) << bad << " for joint " << i;
    }
  }
  for (const std::size_t count :
       {std::size_t{0}, joints - 1, joints + 1, kMaxHandJoints, kMaxHandJoints + 1, SIZE_MAX}) {
    HandCommand command = move(cell_->far_rad);
    command.joint_count = count;
    EXPECT_EQ(hand_->write(command, now()), IoStatus::kRefused) << count << " joints";
  }
  hold_for(milliseconds(200));
  EXPECT_EQ(cell_->motions(), 0U);
  EXPECT_TRUE(is_at(before));
}

TEST_P(HandContract, HugeTargetsAreClampedToTheMotorsRange) {
  if (!cell_->unclamped.empty()) GTEST_SKIP() << cell_->unclamped;
  ASSERT_NO_FATAL_FAILURE(open());
  const auto pursue = [&](double target, Duration span) {
    const std::vector<double> q_rad(cell_->far_rad.size(), target);
    return run([&] { return move(q_rad); }, [&] { return is_at(cell_->most_units); }, span);
  };
  for (const double huge : {1e3, -1e300, std::numeric_limits<double>::max(), -1e3}) {
    pursue(huge, milliseconds(100));
    ASSERT_TRUE(hand_->reason().empty()) << huge << ": " << hand_->reason();
  }
  EXPECT_TRUE(pursue(1e300, 2 * kPatience)) << hand_->reason();
  run([&] { return move(std::vector<double>(cell_->far_rad.size(), 1e300)); }, [] { return false; }, milliseconds(400));
  EXPECT_TRUE(is_at(cell_->most_units)) << "it goes on beyond its limits";
}

TEST_P(HandContract, ReadAndWriteNeverWaitNorTakeHeapWhileTheHandIsSilent) {
  ASSERT_NO_FATAL_FAILURE(open());
  constexpr int kCalls = 1000;
  const HandCommand far = move(cell_->far_rad, std::chrono::minutes(1)), hold = plain(HandAction::kHold);
  Effort reads{Duration::max(), 0}, writes{Duration::max(), 0};
  for (int attempt = 0; attempt < 3 && std::max(reads.time, writes.time) > milliseconds(200); ++attempt) {
    if (attempt > 0) {
      cell_->restore();
      ASSERT_NO_FATAL_FAILURE(connect());
    }
    hold_for(milliseconds(100));
    cell_->hush();
    while (turn() == IoStatus::kDone) {
    }
    int wrong = 0;
    const TimePoint t = now();
    writes = effort_of([&] {
      for (int i = 0; i < kCalls; ++i) {
        const IoStatus status = hand_->write(i % 2 == 0 ? far : hold, t);
        if (status != IoStatus::kDone && status != IoStatus::kEmpty) ++wrong;
      }
    });
    reads = effort_of([&] {
      for (int i = 0; i < kCalls; ++i) wrong += hand_->read(state_) == IoStatus::kEmpty ? 0 : 1;
    });
    EXPECT_EQ(wrong, 0) << hand_->reason();
  }
  EXPECT_LE(to_seconds(reads.time), 0.2);
  EXPECT_LE(to_seconds(writes.time), 0.2);
  EXPECT_TRUE(!cell_->reads_in_place || reads.allocations == 0) << reads.allocations;
  EXPECT_TRUE(!cell_->writes_in_place || writes.allocations == 0) << writes.allocations;
}

TEST_P(HandContract, AWorkingSessionTakesNoHeap) {
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_TRUE(reach(cell_->near_rad, cell_->near_units)) << hand_->reason();
  const TimePoint end = now() + milliseconds(500);
  Effort reads, writes;
  int replies = 0;
  for (TimePoint next = now(); now() < end;) {
    if (now() >= next) {
      const HandCommand command = move(cell_->near_rad);
      writes.allocations += effort_of([&] { last_write_ = hand_->write(command, now()); }).allocations;
      next = now() + milliseconds(50);
    }
    static_cast<void>(transport::wait_readable(info_.fd, now() + milliseconds(5)));
    IoStatus status = IoStatus::kEmpty;
    reads.allocations += effort_of([&] { status = hand_->read(state_); }).allocations;
    replies += status == IoStatus::kDone ? 1 : 0;
  }
  EXPECT_GT(replies, 2);
  EXPECT_TRUE(!cell_->reads_in_place || reads.allocations == 0) << reads.allocations;
  EXPECT_TRUE(!cell_->writes_in_place || writes.allocations == 0) << writes.allocations;
}

TEST_P(HandContract, StatesComeInOrderAndTellWhereTheMotorsAre) {
  ASSERT_NO_FATAL_FAILURE(open());
  HandDeviceState last;
  int states = 0;
  const auto check = [&] {
    if (state_.reply == last.reply) return false;
    EXPECT_GT(state_.reply, last.reply);
    EXPECT_GE(state_.t_arrival, last.t_arrival);
    EXPECT_LE(state_.t_arrival, now());
    EXPECT_EQ(state_.joint_count, cell_->near_rad.size());
    last = state_;
    return ++states >= 20;
  };
  ASSERT_TRUE(run([&] { return move(cell_->near_rad); }, check)) << hand_->reason();
  ASSERT_TRUE(reach(cell_->near_rad, cell_->near_units));
  const auto told = [&] {
    for (std::size_t i = 0; i < cell_->near_rad.size(); ++i) {
      if (std::abs(state_.q_rad[i] - cell_->near_rad[i]) > 0.05) return false;
    }
    return true;
  };
  EXPECT_TRUE(run([&] { return move(cell_->near_rad); }, told)) << hand_->reason();
}

TEST_P(HandContract, TheNewestTargetWins) {
  if (!cell_->drops_newest.empty()) GTEST_SKIP() << cell_->drops_newest;
  ASSERT_NO_FATAL_FAILURE(open());
  hold_for(milliseconds(100));
  const auto both = [&] {
    for (int i = 0; i < 5; ++i) static_cast<void>(hand_->write(move(cell_->far_rad), now()));
    return move(cell_->near_rad);
  };
  const auto there = [&] { return is_at(cell_->near_units); };
  ASSERT_TRUE(run(both, there, 2 * kPatience)) << hand_->reason();
  run(
      both, [] { return false; }, milliseconds(300));
  EXPECT_TRUE(reach(cell_->near_rad, cell_->near_units)) << hand_->reason();
}

TEST_P(HandContract, AStopLatchesUntilAHold) {
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_TRUE(set_out()) << hand_->reason();
  ASSERT_NE(hand_->write(plain(HandAction::kStop), now()), IoStatus::kDisconnected);
  EXPECT_EQ(hand_->write(move(cell_->far_rad), now()), IoStatus::kRefused);
  run([] { return plain(HandAction::kStop); }, [] { return false; }, milliseconds(500));
  const auto stopped = cell_->motors();
  EXPECT_LT(stopped[0], cell_->far_units[0] - 10 * cell_->tolerance) << "it went on to the end";
  run([&] { return move(cell_->far_rad); }, [] { return false; }, milliseconds(300));
  EXPECT_TRUE(is_at(stopped));
  EXPECT_EQ(last_write_, IoStatus::kRefused);
  hold_for(milliseconds(300));
  EXPECT_TRUE(is_at(stopped));
  EXPECT_TRUE(reach(cell_->near_rad, cell_->near_units)) << hand_->reason();
}

}  // namespace
}  // namespace embody::test
