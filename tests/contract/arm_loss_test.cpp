// The contract of ArmDriver, second half: lines and controllers that fail, and the end.
#include <atomic>
#include <thread>

#include "tests/contract/arm_contract.hpp"

namespace embody::test {
namespace {

using std::chrono::milliseconds;
using transport::now;

TEST_P(ArmContract, AHangUpEndsTheSessionInTime) {
  ASSERT_NO_FATAL_FAILURE(open(Pace::kDelivered));
  hold_for(milliseconds(50));
  cell_->cut();
  const auto lost = time_to_loss();
  ASSERT_TRUE(lost) << "the loss was never noticed";
  EXPECT_LE(to_seconds(*lost), to_seconds(cell_->hang_up_bound + kSlack));
  expect_sentence(arm_->reason());
}

TEST_P(ArmContract, ASilentArmEndsTheSessionInTime) {
  ASSERT_NO_FATAL_FAILURE(open(Pace::kDelivered));
  hold_for(milliseconds(50));
  cell_->hush();
  const auto lost = time_to_loss();
  ASSERT_TRUE(lost) << "the loss was never noticed";
  EXPECT_LE(to_seconds(*lost), to_seconds(cell_->silence_bound + kSlack));
  expect_sentence(arm_->reason());
}

TEST_P(ArmContract, ALostSessionStaysLostAndWritesNothing) {
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_TRUE(engage()) << arm_->reason();
  cell_->cut();
  ASSERT_TRUE(time_to_loss());
  cell_->restore();
  const Vector6 before = rest();
  const auto commands = cell_->record().commands;
  const std::string reason(arm_->reason());
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(send(ArmAction::kTrack, before + Vector6::Constant(0.05)), IoStatus::kDisconnected);
    EXPECT_EQ(arm_->read(state_), IoStatus::kDisconnected);
  }
  EXPECT_EQ(arm_->reason(), reason);
  rest();
  EXPECT_TRUE(is_at(before));
  EXPECT_EQ(cell_->record().commands, commands);
}

TEST_P(ArmContract, ALossInTheMiddleOfAMotionStopsTheArm) {
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_TRUE(set_out()) << arm_->reason();
  cell_->cut();
  EXPECT_TRUE(eventually([&] { return stands_still(); }, cell_->stop_bound + kSlack));
  ASSERT_TRUE(time_to_loss());
}

TEST_P(ArmContract, ReconnectingMovesNothingEvenAfterAMotion) {
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_TRUE(set_out()) << arm_->reason();
  cell_->cut();
  ASSERT_TRUE(time_to_loss());
  const Vector6 before = rest();
  const auto motions = cell_->record().motions;
  cell_->restore();
  ASSERT_NO_FATAL_FAILURE(connect());
  EXPECT_TRUE(arm_->reason().empty());
  EXPECT_TRUE(hold_for(milliseconds(300))) << arm_->reason();
  EXPECT_TRUE(is_at(before));

  // The upkeep loads the program again; that moves nothing either, and then the arm can be moved.
  std::atomic<bool> leave{false};
  std::thread upkeep([&] {
    while (!leave) {
      static_cast<void>(arm_->service());
      std::this_thread::sleep_for(milliseconds(20));  // the pace of the upkeep, 50 times the real one
    }
  });
  const auto ready = [&] { return state_.condition == ArmCondition::kReady; };
  EXPECT_TRUE(run([&] { send(ArmAction::kHold); }, ready, 2 * kPatience)) << arm_->reason();
  EXPECT_TRUE(hold_for(milliseconds(200)));
  EXPECT_TRUE(is_at(before));
  EXPECT_EQ(cell_->record().motions, motions);
  EXPECT_TRUE(set_out()) << arm_->reason();
  leave = true;
  hold_for(milliseconds(100));
  upkeep.join();
}

TEST_P(ArmContract, TheDestructorStopsTheArm) {
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_TRUE(set_out()) << arm_->reason();
  arm_.reset();
  EXPECT_TRUE(eventually([&] { return stands_still(); }, cell_->stop_bound + kSlack));
  const Vector6 stopped = cell_->record().q_rad;
  const Vector6 rested = rest();
  EXPECT_LE((rested - stopped).cwiseAbs().maxCoeff(), 0.02) << "it went on";
}

TEST_P(ArmContract, TheDestructorOfAnIdleSessionMovesNothing) {
  const Vector6 before = cell_->record().q_rad;
  ASSERT_NO_FATAL_FAILURE(open());
  hold_for(milliseconds(50));
  arm_.reset();
  rest();
  EXPECT_TRUE(is_at(before));
  EXPECT_EQ(cell_->record().motions, 0U);
  arm_ = cell_->driver(Pace::kPatient);  // one that never connected
  arm_.reset();
}

TEST_P(ArmContract, AnAbsentArmIsAnErrorUntilItIsThere) {
  arm_ = cell_->driver(Pace::kPatient);
  EXPECT_EQ(arm_->read(state_), IoStatus::kDisconnected);
  EXPECT_EQ(send(ArmAction::kHold), IoStatus::kDisconnected);
  cell_->cut();
  expect_absent([&] { return try_to_connect(); });
  EXPECT_EQ(arm_->read(state_), IoStatus::kDisconnected);
  EXPECT_EQ(send(ArmAction::kHold), IoStatus::kDisconnected);
  cell_->restore();
  cell_->hush();
  expect_absent([&] { return try_to_connect(); });
  cell_->restore();
  ASSERT_NO_FATAL_FAILURE(connect());
  EXPECT_TRUE(engage()) << arm_->reason();
}

TEST_P(ArmContract, RubbishFromTheControllerAtWorstEndsTheSession) {
  SCOPED_TRACE(kContractSeed);
  std::mt19937 random(kContractSeed);
  ASSERT_NO_FATAL_FAILURE(open(Pace::kDelivered));
  const Vector6 before = cell_->record().q_rad;
  int losses = 0;
  for (int round = 0; round < 30; ++round) {
    cell_->babble(random);
    static_cast<void>(arm_->service());
    IoStatus status = IoStatus::kEmpty;
    for (int i = 0; i < 10 && status != IoStatus::kDisconnected; ++i) {
      status = turn();
      if (send(ArmAction::kHold) == IoStatus::kDisconnected) status = IoStatus::kDisconnected;
    }
    if (status != IoStatus::kDisconnected) continue;
    expect_sentence(arm_->reason());
    ++losses;
    ASSERT_NO_FATAL_FAILURE(expect_recovery([&] { return try_to_connect(); }));
  }
  std::printf("%s: %d sessions ended in 30 rounds of rubbish\n", GetParam().name, losses);
  EXPECT_TRUE(is_at(before));
  EXPECT_EQ(cell_->record().motions, 0U);
}

}  // namespace

INSTANTIATE_TEST_SUITE_P(Every, ArmContract,
                         ::testing::Values(ArmKind{"UrESeries500Hz", ur_e_series}, ArmKind{"UrCb3At125Hz", ur_cb3}),
                         [](const auto& kind) { return kind.param.name; });

}  // namespace embody::test
