// The contract of HandDriver, second half: lines and hands that fail, and the end.
#include "tests/contract/hand_contract.hpp"

namespace embody::test {
namespace {

using std::chrono::milliseconds;
using transport::now;

/// Every way to lose a hand must end like this.
#define EXPECT_OVER(lost, bound)                            \
  ASSERT_TRUE(lost) << "the loss was never noticed";        \
  EXPECT_LE(to_seconds(*lost), to_seconds(bound + kSlack)); \
  expect_sentence(hand_->reason())

TEST_P(HandContract, AHangUpEndsTheSessionInTime) {
  ASSERT_NO_FATAL_FAILURE(open(Pace::kDelivered));
  hold_for(milliseconds(100));
  cell_->cut();
  const auto lost = time_to_loss(HandAction::kHold);
  EXPECT_OVER(lost, cell_->hang_up_bound);
}

TEST_P(HandContract, ASilentHandEndsTheSessionInTime) {
  ASSERT_NO_FATAL_FAILURE(open(Pace::kDelivered));
  hold_for(milliseconds(100));
  cell_->hush();
  const auto lost = time_to_loss(HandAction::kMove);
  EXPECT_OVER(lost, cell_->silence_bound);
}

TEST_P(HandContract, ALostSessionStaysLostAndWritesNothing) {
  ASSERT_NO_FATAL_FAILURE(open(Pace::kDelivered));
  hold_for(milliseconds(100));
  cell_->cut();
  ASSERT_TRUE(time_to_loss(HandAction::kHold));
  cell_->restore();
  const auto before = rest();
  const auto motions = cell_->motions();
  const std::string reason(hand_->reason());
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(hand_->write(move(cell_->far_rad), now()), IoStatus::kDisconnected);
    EXPECT_EQ(hand_->read(state_), IoStatus::kDisconnected);
  }
  EXPECT_EQ(hand_->reason(), reason);
  EXPECT_EQ(rest(), before);
  EXPECT_EQ(cell_->motions(), motions);
}

TEST_P(HandContract, ReconnectingMovesNothingEvenAfterAMotion) {
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_TRUE(set_out()) << hand_->reason();
  cell_->cut();
  ASSERT_TRUE(time_to_loss(HandAction::kMove));
  const auto before = rest();  // the hand finishes what it was told
  const auto motions = cell_->motions();
  cell_->restore();
  ASSERT_NO_FATAL_FAILURE(connect());
  EXPECT_TRUE(hand_->reason().empty());
  hold_for(milliseconds(400));
  EXPECT_TRUE(is_at(before));
  EXPECT_EQ(cell_->motions(), motions);
  ASSERT_TRUE(reach(cell_->near_rad, cell_->near_units)) << hand_->reason();
}

TEST_P(HandContract, ConnectingAnewInTheMiddleOfAMotionMovesNothingOn) {
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_TRUE(set_out()) << hand_->reason();
  ASSERT_NO_FATAL_FAILURE(connect());
  const auto stopped = rest();
  EXPECT_LT(stopped[0], cell_->far_units[0] - 10 * cell_->tolerance) << "it went on to the end";
}

TEST_P(HandContract, TheDestructorStopsTheMotors) {
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_TRUE(set_out()) << hand_->reason();
  hand_.reset();
  const auto stopped = rest();
  EXPECT_LT(stopped[0], cell_->far_units[0] - 10 * cell_->tolerance) << "it went on to the end";
}

TEST_P(HandContract, TheDestructorOfAnIdleSessionMovesNothing) {
  const auto before = cell_->motors();
  ASSERT_NO_FATAL_FAILURE(open());
  hold_for(milliseconds(100));
  hand_.reset();
  EXPECT_EQ(cell_->motions(), 0U);
  EXPECT_TRUE(is_at(before));
  hand_ = cell_->driver(Pace::kPatient);  // one that never connected
  hand_.reset();
}

TEST_P(HandContract, AnAbsentHandIsAnErrorUntilItIsThere) {
  hand_ = cell_->driver(Pace::kPatient);
  EXPECT_EQ(hand_->read(state_), IoStatus::kDisconnected);
  EXPECT_EQ(hand_->write(move(cell_->far_rad), now()), IoStatus::kDisconnected);
  cell_->cut();
  expect_absent([&] { return try_to_connect(); });
  EXPECT_EQ(hand_->read(state_), IoStatus::kDisconnected);
  EXPECT_EQ(hand_->write(move(cell_->far_rad), now()), IoStatus::kDisconnected);
  cell_->restore();
  cell_->hush();
  expect_absent([&] { return try_to_connect(); });
  cell_->restore();
  ASSERT_NO_FATAL_FAILURE(connect());
  EXPECT_TRUE(reach(cell_->near_rad, cell_->near_units)) << hand_->reason();
}

TEST_P(HandContract, RubbishFromTheHandAtWorstEndsTheSession) {
  SCOPED_TRACE(kContractSeed);
  std::mt19937 random(kContractSeed);
  ASSERT_NO_FATAL_FAILURE(open(Pace::kDelivered));
  const auto before = cell_->motors();
  int losses = 0;
  for (int round = 0; round < 40; ++round) {
    cell_->babble(random);
    static_cast<void>(hand_->write(plain(HandAction::kHold), now()));
    IoStatus status = IoStatus::kEmpty;
    for (int i = 0; i < 5 && status != IoStatus::kDisconnected; ++i) status = turn();
    if (status != IoStatus::kDisconnected) continue;
    expect_sentence(hand_->reason());
    ++losses;
    ASSERT_NO_FATAL_FAILURE(expect_recovery([&] { return try_to_connect(); }));
  }
  std::printf("%s: %d sessions ended in 40 rounds of rubbish\n", GetParam().name, losses);
  EXPECT_EQ(cell_->motions(), 0U);
  EXPECT_TRUE(is_at(before));
  hand_ = cell_->driver(Pace::kPatient);
  ASSERT_NO_FATAL_FAILURE(connect());
  EXPECT_TRUE(reach(cell_->near_rad, cell_->near_units)) << hand_->reason();
}

}  // namespace

INSTANTIATE_TEST_SUITE_P(Every, HandContract,
                         ::testing::Values(HandKind{"MiaSerial", mia_serial_acknowledging},
                                           HandKind{"MiaSerialStreaming", mia_serial_streaming},
                                           HandKind{"MiaCanIsoTp", mia_can_isotp},
                                           HandKind{"MiaCanSegments", mia_can_segments},
                                           HandKind{"MiaCanCompact", mia_can_compact}, HandKind{"Robotiq", robotiq},
                                           HandKind{"JointStateOverDds", joint_state}),
                         [](const auto& kind) { return kind.param.name; });

}  // namespace embody::test
