// The contract of ArmDriver, first half: what commands do.
#include <atomic>
#include <cmath>
#include <limits>
#include <thread>

#include "tests/contract/arm_contract.hpp"

namespace embody::test {
namespace {

using std::chrono::milliseconds;
using transport::now;

TEST_P(ArmContract, ConnectingMovesNothingAndTellsWhatIsThere) {
  const Vector6 before = cell_->record().q_rad;
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_GE(info_.fd, 0);
  EXPECT_EQ(info_.rate_hz, cell_->rate_hz);
  expect_sentence(info_.peer.view());
  EXPECT_TRUE(arm_->reason().empty());
  EXPECT_TRUE(hold_for(milliseconds(300))) << arm_->reason();
  EXPECT_EQ(cell_->record().motions, 0U);
  EXPECT_TRUE(is_at(before));
}

TEST_P(ArmContract, AnExpiredCommandIsRefusedAndAFreshOneGoes) {
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_TRUE(hold_for(milliseconds(100))) << arm_->reason();
  ASSERT_TRUE(eventually([&] { return cell_->record().commands > 3; }));
  const ArmRecord before = [&] {
    rest();
    return cell_->record();
  }();
  for (const ArmAction action : {ArmAction::kHold, ArmAction::kTrack, ArmAction::kExit}) {
    ArmCommand late = command(action, before.q_rad);
    late.t_expires = now() - milliseconds(1);
    EXPECT_EQ(arm_->write(late, now()), IoStatus::kRefused);
    late.t_expires = {};
    EXPECT_EQ(arm_->write(late, now()), IoStatus::kRefused);
  }
  rest();
  EXPECT_EQ(cell_->record().commands, before.commands);
  EXPECT_EQ(send(ArmAction::kHold), IoStatus::kDone);
  EXPECT_TRUE(eventually([&] { return cell_->record().commands == before.commands + 1; }));
}

TEST_P(ArmContract, TargetsThatAreNoNumbersAreRefused) {
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_TRUE(engage()) << arm_->reason();
  const ArmRecord before = cell_->record();
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), -HUGE_VAL}) {
    for (int joint = 0; joint < 6; ++joint) {
      Vector6 q_rad = before.q_rad, qd_rad_s = Vector6::Zero();
      q_rad[joint] = bad;
      EXPECT_EQ(send(ArmAction::kTrack, q_rad), IoStatus::kRefused) << bad;
      qd_rad_s[joint] = bad;
      EXPECT_EQ(send(ArmAction::kTrack, before.q_rad, qd_rad_s), IoStatus::kRefused) << bad;
    }
  }
  rest();
  EXPECT_TRUE(is_at(before.q_rad));
}

TEST_P(ArmContract, HugeTargetsNeverMakeTheArmFast) {
  for (const double huge : {10.0, 1e6, 1e300, -1e300, std::numeric_limits<double>::max()}) {
    cell_ = GetParam().make();
    ASSERT_NO_FATAL_FAILURE(open());
    ASSERT_TRUE(engage()) << arm_->reason();
    double fastest = 0.0;
    const auto watch = [&] {
      fastest = std::max(fastest, std::abs(cell_->record().qd_rad_s[0]));
      return false;
    };
    run([&] { send(ArmAction::kTrack, Vector6::Constant(huge), Vector6::Constant(huge)); }, watch, milliseconds(500));
    EXPECT_TRUE(arm_->reason().empty()) << arm_->reason();
    EXPECT_LE(fastest, 1.05 * cell_->top_speed_rad_s) << huge;
    arm_.reset();
    EXPECT_TRUE(rest().allFinite());
  }
}

TEST_P(ArmContract, ReadAndWriteNeverWaitNorTakeHeapWhileTheArmIsSilent) {
  ASSERT_NO_FATAL_FAILURE(open());
  constexpr int kCalls = 1000;
  Effort reads{Duration::max(), 0}, writes{Duration::max(), 0};
  for (int attempt = 0; attempt < 3 && std::max(reads.time, writes.time) > milliseconds(200); ++attempt) {
    if (attempt > 0) {
      cell_->restore();
      ASSERT_NO_FATAL_FAILURE(connect());
    }
    ASSERT_TRUE(hold_for(milliseconds(100))) << arm_->reason();
    cell_->hush();
    while (turn() == IoStatus::kDone) {
    }
    int wrong = 0;
    ArmCommand hold = command(ArmAction::kHold);
    hold.t_expires = now() + std::chrono::minutes(1);
    const TimePoint t = now();
    writes = effort_of([&] {
      for (int i = 0; i < kCalls; ++i) {
        const IoStatus status = arm_->write(hold, t);
        if (status != IoStatus::kDone && status != IoStatus::kEmpty) ++wrong;
      }
    });
    reads = effort_of([&] {
      for (int i = 0; i < kCalls; ++i) wrong += arm_->read(state_) == IoStatus::kEmpty ? 0 : 1;
    });
    EXPECT_EQ(wrong, 0) << arm_->reason();
  }
  EXPECT_LE(to_seconds(reads.time), 0.2);
  EXPECT_LE(to_seconds(writes.time), 0.2);
  EXPECT_EQ(reads.allocations + writes.allocations, 0U);
}

TEST_P(ArmContract, AWorkingSessionTakesNoHeap) {
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_TRUE(engage()) << arm_->reason();
  const Vector6 q_rad = state_.q_rad;
  std::uint64_t allocations = 0;
  int states = 0;
  for (const TimePoint end = now() + kPatience; states < 100 && now() < end;) {
    static_cast<void>(transport::wait_readable(info_.fd, now() + milliseconds(20)));
    IoStatus status = IoStatus::kEmpty;
    allocations += effort_of([&] { status = arm_->read(state_); }).allocations;
    if (status != IoStatus::kDone) continue;
    ++states;
    allocations += effort_of([&] { send(ArmAction::kTrack, q_rad); }).allocations;
  }
  EXPECT_EQ(states, 100) << arm_->reason();
  EXPECT_EQ(allocations, 0U);
}

TEST_P(ArmContract, StatesComeInOrder) {
  ASSERT_NO_FATAL_FAILURE(open());
  ArmState last;
  int states = 0;
  const auto check = [&] {
    EXPECT_EQ(state_.package, last.package + 1);
    EXPECT_GE(state_.t_arrival, last.t_arrival);
    EXPECT_LE(state_.t_arrival, now());
    EXPECT_TRUE(states == 0 || state_.controller_time > last.controller_time);
    EXPECT_GE(state_.echo_sequence, last.echo_sequence);
    EXPECT_LE(state_.echo_sequence, sequence_);
    last = state_;
    ++states;
    send(ArmAction::kHold);
  };
  EXPECT_TRUE(run(check, [&] { return states >= 200; })) << arm_->reason();
}

TEST_P(ArmContract, TheNewestTargetWins) {
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_TRUE(engage()) << arm_->reason();
  Vector6 aside = state_.q_rad, goal = state_.q_rad;
  aside[0] += 0.05;
  goal[0] -= 0.05;
  const auto both = [&] {
    send(ArmAction::kTrack, aside);
    send(ArmAction::kTrack, goal);
  };
  EXPECT_TRUE(run(both, [&] { return is_at(goal); })) << cell_->record().q_rad.transpose();
}

TEST_P(ArmContract, ServiceRunsBesideReadAndWrite) {
  ASSERT_NO_FATAL_FAILURE(open());
  std::atomic<bool> leave{false};
  std::atomic<int> rounds{0};
  std::thread upkeep([&] {
    while (!leave) {
      static_cast<void>(arm_->service());
      ++rounds;
    }
  });
  const bool tracked = engage();
  const Vector6 q_rad = state_.q_rad;
  run([&] { send(ArmAction::kTrack, q_rad); }, [] { return false; }, std::chrono::seconds(1));
  leave = true;
  run([&] { send(ArmAction::kTrack, q_rad); }, [] { return false; }, milliseconds(100));
  upkeep.join();
  EXPECT_TRUE(tracked);
  EXPECT_TRUE(state_.tracking || engage()) << "a stall of this computer may end tracking, but not the program";
  EXPECT_TRUE(arm_->reason().empty()) << arm_->reason();
  EXPECT_GT(rounds, 0);
  EXPECT_TRUE(is_at(q_rad));
}

}  // namespace
}  // namespace embody::test
