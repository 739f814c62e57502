// What DdsPublisher puts on its topics, read back through Cyclone in the same process.
#include "daemon/dds/publisher.hpp"

#include <pthread.h>
#include <sys/socket.h>

#include <algorithm>
#include <map>
#include <random>
#include <thread>

#include "embody_msgs.h"
#include "sensor_msgs.h"
#include "tests/unit/dds/dds_test_support.hpp"

namespace embody {
namespace {

using dds::test::private_config;
using dds::test::private_domain;
using dds::test::Reader;

constexpr unsigned kSeed = 7;

WallTime wall(std::int64_t ns) {
  return WallTime(Duration(ns));
}

Pose random_pose(std::mt19937& generator) {
  std::normal_distribution<double> normal;
  Pose X = Pose::Identity();
  X.linear() = Eigen::Quaterniond(normal(generator), normal(generator), normal(generator), normal(generator))
                   .normalized()
                   .toRotationMatrix();
  X.translation() = Eigen::Vector3d(normal(generator), normal(generator), normal(generator));
  return X;
}

void expect_pose(const geometry_msgs_msg_dds__Pose_& message, const Pose& X) {
  EXPECT_EQ(Eigen::Vector3d(message.position.x, message.position.y, message.position.z), X.translation());
  const Eigen::Quaterniond q(message.orientation.w, message.orientation.x, message.orientation.y,
                             message.orientation.z);
  EXPECT_LT((q.toRotationMatrix() - X.linear()).norm(), 1e-14);
}

TEST(DdsPublisher, JointStatesArriveExactly) {
  auto publisher = DdsPublisher::create(private_config());
  ASSERT_TRUE(publisher) << publisher.error().detail.c_str();
  Reader<sensor_msgs_msg_dds__JointState_> reader(sensor_msgs_msg_dds__JointState__desc,
                                                  "rt/embody/right/joint_states");
  SCOPED_TRACE(kSeed);
  std::mt19937 generator(kSeed);
  std::normal_distribution<double> normal;
  for (std::size_t joints : {0U, 1U, 6U, 32U}) {
    std::vector<std::string> names;
    std::vector<double> q, qd;
    for (std::size_t i = 0; i < joints; ++i) {
      names.push_back("joint_" + std::to_string(i));
      q.push_back(normal(generator));
      qd.push_back(normal(generator));
    }
    if (joints == 1) qd.clear();  // velocities are optional
    ASSERT_TRUE(publisher->publish_joint_states(names, q, qd, wall(1'700'000'000'123'456'789)));
    const auto* m = reader.next();
    ASSERT_NE(m, nullptr);
    EXPECT_EQ(m->header.stamp.sec, 1'700'000'000);
    EXPECT_EQ(m->header.stamp.nanosec, 123'456'789U);
    EXPECT_EQ(std::vector<std::string>(m->name._buffer, m->name._buffer + m->name._length), names);
    EXPECT_EQ(std::vector<double>(m->position._buffer, m->position._buffer + m->position._length), q);
    EXPECT_EQ(std::vector<double>(m->velocity._buffer, m->velocity._buffer + m->velocity._length), qd);
    EXPECT_EQ(m->effort._length, 0U);
  }
}

TEST(DdsPublisher, JointStatesOfUnequalLengthAreDroppedAndCounted) {
  auto publisher = DdsPublisher::create(private_config());
  ASSERT_TRUE(publisher) << publisher.error().detail.c_str();
  const std::vector<std::string> names{"a", "b"};
  const std::vector<double> one{1.0}, two{1.0, 2.0};
  EXPECT_FALSE(publisher->publish_joint_states(names, one, {}, {}));
  EXPECT_FALSE(publisher->publish_joint_states(names, two, one, {}));
  EXPECT_TRUE(publisher->publish_joint_states(names, two, two, {}));
  EXPECT_EQ(publisher->counters().failed, 2U);
  EXPECT_EQ(publisher->counters().published, 1U);
}

TEST(DdsPublisher, HandPosesArriveExactly) {
  auto publisher = DdsPublisher::create(private_config());
  ASSERT_TRUE(publisher) << publisher.error().detail.c_str();
  Reader<geometry_msgs_msg_dds__PoseStamped_> reader(geometry_msgs_msg_dds__PoseStamped__desc,
                                                     "rt/embody/right/hand_pose");
  std::mt19937 generator(kSeed);
  for (int i = 0; i < 100; ++i) {
    const Pose X_WM = random_pose(generator);
    ASSERT_TRUE(publisher->publish_hand_pose(X_WM, "mocap", wall(i)));
    const auto* m = reader.next();
    ASSERT_NE(m, nullptr);
    EXPECT_STREQ(m->header.frame_id, "mocap");
    EXPECT_EQ(m->header.stamp.nanosec, static_cast<std::uint32_t>(i));
    expect_pose(m->pose, X_WM);
  }
}

TEST(DdsPublisher, HandStatesArriveExactlyAndWithWallClockStamps) {
  auto publisher = DdsPublisher::create(private_config());
  ASSERT_TRUE(publisher) << publisher.error().detail.c_str();
  Reader<embody_msgs_msg_dds__HandState_> reader(embody_msgs_msg_dds__HandState__desc, "rt/embody/right/hand_state");
  std::mt19937 generator(kSeed);
  HandState hand;
  hand.frame_number = 0x1234'5678'9abc'def0;
  hand.t_arrival = std::chrono::steady_clock::now();
  hand.t_estimated = hand.t_arrival + std::chrono::milliseconds(3);
  hand.X_WM = random_pose(generator);
  for (std::size_t i = 0; i < kHandAngles; ++i) hand.q_rad(static_cast<int>(i)) = 0.01 * static_cast<double>(i);
  hand.residual_m = {0.001, 0.002, 0.003, 0.004, 0.005};
  hand.visible_markers = {2, 1, 0, 2, 1};
  hand.quality = {FingerQuality::kNone, FingerQuality::kAtLimit, FingerQuality::kCapped, FingerQuality::kHeld,
                  FingerQuality::kLost};
  hand.confidence = {0.0, 0.25, 0.5, 0.75, 1.0};
  hand.hand_confidence = 0.125;
  hand.valid = true;
  const auto wall_now = std::chrono::system_clock::now();
  ASSERT_TRUE(publisher->publish_hand_state(hand));
  const auto* m = reader.next();
  ASSERT_NE(m, nullptr);
  EXPECT_EQ(m->frame_number, hand.frame_number);
  EXPECT_EQ(m->capture_ns, 0) << "unknown stays unknown";
  const double off_s = to_seconds(wall(m->arrival_ns) - wall_now);
  EXPECT_LT(std::abs(off_s), 1.0);
  EXPECT_NEAR(static_cast<double>(m->estimated_ns - m->arrival_ns), 3e6, 2e6);
  expect_pose(m->pose, hand.X_WM);
  EXPECT_TRUE(std::equal(hand.q_rad.begin(), hand.q_rad.end(), std::begin(m->q_rad), std::end(m->q_rad)));
  EXPECT_TRUE(std::equal(hand.residual_m.begin(), hand.residual_m.end(), m->residual_m));
  EXPECT_TRUE(std::equal(hand.visible_markers.begin(), hand.visible_markers.end(), m->visible_markers));
  const std::array<std::uint8_t, 5> quality{0, 4, 2, 3, 5};
  EXPECT_TRUE(std::equal(quality.begin(), quality.end(), m->quality));
  EXPECT_TRUE(std::equal(hand.confidence.begin(), hand.confidence.end(), m->confidence));
  EXPECT_EQ(m->hand_confidence, hand.hand_confidence);
  EXPECT_TRUE(m->valid);
}

TEST(DdsPublisher, HandTelemetryArrivesExactly) {
  auto publisher = DdsPublisher::create(private_config());
  ASSERT_TRUE(publisher) << publisher.error().detail.c_str();
  Reader<embody_msgs_msg_dds__HandTelemetry_> reader(embody_msgs_msg_dds__HandTelemetry__desc,
                                                     "rt/embody/right/hand_telemetry");
  const std::vector<std::string> joints{"thumb", "index"};
  HandDeviceState hand;
  hand.joint_count = 2;
  hand.q_rad[1] = 0.5;
  EXPECT_FALSE(publisher->publish_hand_telemetry(hand, std::span(joints).first(1))) << "another hand's joints";
  ASSERT_TRUE(publisher->publish_hand_telemetry(hand, joints));
  const auto* m = reader.next();
  ASSERT_NE(m, nullptr);
  EXPECT_EQ(m->arrival_ns, 0);
  EXPECT_STREQ(m->condition, "unknown");
  EXPECT_EQ(m->current_a._length + m->current_raw._length + m->force._length, 0U) << "not measured";
  ASSERT_EQ(m->position_rad._length, 2U);
  EXPECT_EQ(m->position_rad._buffer[1], 0.5);

  hand.t_arrival = std::chrono::steady_clock::now();
  hand.telemetry.condition = HandCondition::kFault;
  hand.telemetry.why_not = "too hot";
  hand.telemetry.supply = HandSupply::kLow;
  hand.telemetry.t_current = hand.telemetry.t_force = hand.t_arrival;
  hand.telemetry.current_count = 2;
  hand.telemetry.current_raw = {7, 9};
  hand.telemetry.force[1] = {true, -3, 4};
  ASSERT_TRUE(publisher->publish_hand_telemetry(hand, joints));
  m = reader.next();
  ASSERT_NE(m, nullptr);
  EXPECT_GT(m->arrival_ns, 0);
  EXPECT_STREQ(m->condition, "fault");
  EXPECT_STREQ(m->why_not, "too hot");
  EXPECT_STREQ(m->supply, "low");
  EXPECT_STREQ(m->joint._buffer[1], "index");
  EXPECT_EQ(m->current_a._length, 0U) << "raw numbers are no ampere";
  ASSERT_EQ(m->current_raw._length, 2U);
  EXPECT_EQ(m->current_raw._buffer[1], 9.0);
  ASSERT_EQ(m->force._length, 1U);
  EXPECT_EQ(m->force._buffer[0].finger, 1);
  EXPECT_EQ(m->force._buffer[0].normal, -3);
  EXPECT_EQ(m->force._buffer[0].tangential, 4);
}

TEST(DdsPublisher, MarkersArriveExactly) {
  auto publisher = DdsPublisher::create(private_config());
  ASSERT_TRUE(publisher) << publisher.error().detail.c_str();
  Reader<embody_msgs_msg_dds__Markers_> reader(embody_msgs_msg_dds__Markers__desc, "rt/embody/right/markers");
  MarkersSample sample;
  sample.frame_number = 0x1234'5678'9abc'def0;
  sample.t_capture = wall(1'700'000'000'123'456'789);
  sample.markers.push_back({"index_tip", 1, true, 3, "middle_tip", {1.0, 2.0, 3.0}, 0.004});
  sample.markers.push_back({"hand_top", MarkersSample::kBack, false, 1, "", {}, -1.0});
  sample.back = "good";
  sample.back_fit_error_m = 0.0005;
  sample.findings = {"index_tip and middle_tip are probably swapped", "ring_tip is not seen"};
  ASSERT_TRUE(publisher->publish_markers(sample));
  const auto* m = reader.next();
  ASSERT_NE(m, nullptr);
  EXPECT_EQ(m->frame_number, sample.frame_number);
  EXPECT_EQ(m->capture_ns, 1'700'000'000'123'456'789);
  ASSERT_EQ(m->markers._length, 2U);
  const auto& tip = m->markers._buffer[0];
  EXPECT_STREQ(tip.name, "index_tip");
  EXPECT_EQ(tip.finger, 1);
  EXPECT_TRUE(tip.seen);
  EXPECT_EQ(tip.verdict, 3);
  EXPECT_STREQ(tip.source, "middle_tip");
  EXPECT_EQ(tip.position[2], 3.0);
  EXPECT_EQ(tip.residual_m, 0.004);
  EXPECT_EQ(m->markers._buffer[1].finger, 254);
  EXPECT_EQ(m->markers._buffer[1].residual_m, -1.0);
  EXPECT_STREQ(m->back, "good");
  EXPECT_EQ(m->back_fit_error_m, 0.0005);
  ASSERT_EQ(m->findings._length, 2U);
  EXPECT_STREQ(m->findings._buffer[1], "ring_tip is not seen");
}

TEST(DdsPublisher, StatusArrivesExactly) {
  auto publisher = DdsPublisher::create(private_config());
  ASSERT_TRUE(publisher) << publisher.error().detail.c_str();
  Reader<embody_msgs_msg_dds__Status_> reader(embody_msgs_msg_dds__Status__desc, "rt/embody/status");
  const StatusSample status{wall(5'000'000'001),
                            "engaged",
                            "operator",
                            42,
                            {{"frames_used", 1}, {"lost", 2}},
                            {{"arm", 500.0}},
                            {{"capture_to_command", 1000, 210.5, 400.0, 900.0, 1234.0}}};
  ASSERT_TRUE(publisher->publish_status(status));
  const auto* m = reader.next();
  ASSERT_NE(m, nullptr);
  EXPECT_EQ(m->stamp.sec, 5);
  EXPECT_EQ(m->stamp.nanosec, 1U);
  EXPECT_STREQ(m->mode, "engaged");
  EXPECT_STREQ(m->cause, "operator");
  EXPECT_EQ(m->epoch, 42U);
  ASSERT_EQ(m->counters._length, 2U);
  EXPECT_STREQ(m->counters._buffer[1].name, "lost");
  EXPECT_EQ(m->counters._buffer[1].value, 2U);
  ASSERT_EQ(m->rates._length, 1U);
  EXPECT_STREQ(m->rates._buffer[0].name, "arm");
  EXPECT_EQ(m->rates._buffer[0].rate_hz, 500.0);
  ASSERT_EQ(m->latencies._length, 1U);
  const auto& latency = m->latencies._buffer[0];
  EXPECT_STREQ(latency.name, "capture_to_command");
  EXPECT_EQ(latency.count, 1000U);
  EXPECT_EQ(latency.p50_us, 210.5);
  EXPECT_EQ(latency.p99_us, 400.0);
  EXPECT_EQ(latency.p999_us, 900.0);
  EXPECT_EQ(latency.max_us, 1234.0);
}

/// What discovery announces of the writers: topic name -> type name; every quality of service is checked on the way.
std::map<std::string, std::string> announced_writers() {
  const dds_entity_t participant =
      dds_create_participant(static_cast<dds_domainid_t>(private_domain()), nullptr, nullptr);
  const dds_entity_t reader = dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr);
  std::map<std::string, std::string> writers;
  void* samples[16] = {nullptr};
  dds_sample_info_t infos[16];
  const dds_return_t taken = dds_take(reader, samples, infos, 16, 16);
  for (int i = 0; i < taken; ++i) {
    const auto* endpoint = static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
    writers[endpoint->topic_name] = endpoint->type_name;
    dds_reliability_kind_t reliability{};
    dds_duration_t blocking{-1};
    dds_history_kind_t history{};
    std::uint32_t representations{0};
    dds_data_representation_id_t* representation{nullptr};
    EXPECT_TRUE(dds_qget_reliability(endpoint->qos, &reliability, &blocking));
    EXPECT_EQ(reliability, DDS_RELIABILITY_RELIABLE);
    EXPECT_EQ(blocking, 0);
    EXPECT_TRUE(dds_qget_history(endpoint->qos, &history, nullptr));
    EXPECT_EQ(history, DDS_HISTORY_KEEP_LAST);
    EXPECT_TRUE(dds_qget_data_representation(endpoint->qos, &representations, &representation));
    EXPECT_TRUE(representations == 1 && representation[0] == DDS_DATA_REPRESENTATION_XCDR1);
    dds_free(representation);
  }
  if (taken > 0) (void)dds_return_loan(reader, samples, taken);
  dds_delete(participant);
  return writers;
}

TEST(DdsPublisher, TopicsAndTypesAreNamedAsRos2NamesThem) {
  DdsConfig config = private_config();
  config.side = "left";
  auto publisher = DdsPublisher::create(config);
  ASSERT_TRUE(publisher) << publisher.error().detail.c_str();
  const std::map<std::string, std::string> expected{
      {"rt/embody/left/joint_states", "sensor_msgs::msg::dds_::JointState_"},
      {"rt/embody/left/hand_pose", "geometry_msgs::msg::dds_::PoseStamped_"},
      {"rt/embody/left/hand_state", "embody_msgs::msg::dds_::HandState_"},
      {"rt/embody/left/hand_telemetry", "embody_msgs::msg::dds_::HandTelemetry_"},
      {"rt/embody/left/markers", "embody_msgs::msg::dds_::Markers_"},
      {"rt/embody/status", "embody_msgs::msg::dds_::Status_"}};
  EXPECT_EQ(announced_writers(), expected);
}

TEST(DdsPublisher, WritesAtOnceWhenNobodyListens) {
  auto publisher = DdsPublisher::create(private_config());
  ASSERT_TRUE(publisher) << publisher.error().detail.c_str();
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 10'000; ++i) ASSERT_TRUE(publisher->publish_hand_state({}));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
  EXPECT_EQ(publisher->counters().published, 10'000U);
  EXPECT_EQ(publisher->counters().failed, 0U);
}

TEST(DdsPublisher, EveryUdpSocketOfItCarriesALockedSourceFilterAndDiesWithIt) {
  const auto before = dds::udp_sockets();
  ASSERT_TRUE(before);
  {
    auto publisher = DdsPublisher::create(private_config());
    ASSERT_TRUE(publisher) << publisher.error().detail.c_str();
    Reader<embody_msgs_msg_dds__Status_> reader(embody_msgs_msg_dds__Status__desc, "rt/embody/status");
    ASSERT_TRUE(publisher->publish_status({}));
    ASSERT_NE(reader.next(), nullptr);
    const auto during = dds::udp_sockets();  // also what a participant and a write may have opened
    ASSERT_TRUE(during);
    EXPECT_GE(publisher->filtered_sockets(), 2U);
    EXPECT_EQ(during->size(), before->size() + publisher->filtered_sockets());
    for (const dds::UdpSocket& s : *during) {
      const bool ours = std::find(before->begin(), before->end(), s) == before->end();
      EXPECT_EQ(dds::test::has_locked_filter(s.fd), ours) << "descriptor " << s.fd;
    }
  }
  const auto after = dds::udp_sockets();
  ASSERT_TRUE(after);
  EXPECT_EQ(*after, *before);
}

TEST(DdsPublisher, DisabledItOpensNoSocketAndPublishesNothing) {
  DdsConfig config = private_config();
  config.enabled = false;
  const auto before = dds::udp_sockets();
  auto publisher = DdsPublisher::create(config);
  ASSERT_TRUE(publisher);
  EXPECT_FALSE(publisher->publish_hand_state({}));
  EXPECT_FALSE(publisher->publish_status({}));
  EXPECT_FALSE(publisher->publish_hand_pose(Pose::Identity(), "mocap", {}));
  EXPECT_FALSE(publisher->publish_joint_states({}, {}, {}, {}));
  EXPECT_EQ(publisher->filtered_sockets(), 0U);
  EXPECT_EQ(publisher->counters().published + publisher->counters().failed, 0U);
  EXPECT_EQ(*dds::udp_sockets(), *before);
}

TEST(DdsPublisher, RefusesASecondPublisherInTheSameDomainAndTheFirstGoesOn) {
  auto first = DdsPublisher::create(private_config());
  ASSERT_TRUE(first) << first.error().detail.c_str();
  const auto second = DdsPublisher::create(private_config());
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, Errc::kRefused);
  EXPECT_TRUE(first->publish_hand_state({}));
}

TEST(DdsPublisher, RefusesImpossibleConfigurationsAndLeavesNoSocketOpen) {
  const auto before = dds::udp_sockets();
  const auto refused = [](auto change) {
    DdsConfig config = private_config();
    change(config);
    const auto publisher = DdsPublisher::create(config);
    return !publisher.ok() && !publisher.error().detail.empty();
  };
  EXPECT_TRUE(refused([](DdsConfig& c) { c.domain = -1; }));
  EXPECT_TRUE(refused([](DdsConfig& c) { c.domain = 233; }));
  EXPECT_TRUE(refused([](DdsConfig& c) { c.side = ""; }));
  EXPECT_TRUE(refused([](DdsConfig& c) { c.side = "right/../x"; }));
  EXPECT_TRUE(refused([](DdsConfig& c) { c.interface = "no-such-if"; }));
  EXPECT_TRUE(refused([](DdsConfig& c) { c.interface = "lo\"/><!--"; }));
  EXPECT_TRUE(refused([](DdsConfig& c) { c.networks = {"127.0.0.1/8"}; }));
  EXPECT_TRUE(refused([](DdsConfig& c) { c.networks.assign(17, "127.0.0.0/8"); }));
  EXPECT_EQ(*dds::udp_sockets(), *before);
}

TEST(DdsPublisher, RefusesToStartItsThreadsFromARealTimeThread) {
  bool permitted = false, refused = false;
  std::thread([&] {
    const sched_param priority{1};
    permitted = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &priority) == 0;
    const auto publisher = DdsPublisher::create(private_config());
    refused = !publisher && publisher.error().code == Errc::kRefused;
  }).join();
  if (!permitted) GTEST_SKIP() << "this account may not use SCHED_FIFO";
  EXPECT_TRUE(refused);
}

TEST(ToWallTime, KeepsDifferencesAndTheUnknown) {
  EXPECT_EQ(to_wall_time(TimePoint{}), WallTime{});
  const TimePoint now = std::chrono::steady_clock::now();
  const Duration apart = to_wall_time(now) - to_wall_time(now - std::chrono::seconds(10));
  EXPECT_NEAR(to_seconds(apart), 10.0, 0.1);
}

}  // namespace
}  // namespace embody
