// Prints what embodyd shows on DDS: joint states, hand pose, hand state, the robot hand's telemetry, markers and
// status.
//   embody-dds-subscriber [--domain N] [--side right] [--count N] [--timeout SECONDS]
// Ends after --count samples or --timeout seconds (default: never). Exit code 1: not one sample came, or DDS failed.
// Without $CYCLONEDDS_URI it listens on the loopback only, like the daemon.
#include <dds/dds.h>
#include <getopt.h>
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>

#include "embody_msgs.h"
#include "sensor_msgs.h"

enum { kTopics = 6, kBatch = 16 };

static const char kLoopbackOnly[] =
    "<CycloneDDS><Domain Id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\" "
    "multicast=\"false\"/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><Peers><Peer address=\"localhost\"/></Peers></Discovery>"
    "</Domain></CycloneDDS>";

struct options {
  dds_domainid_t domain;
  const char* side;
  unsigned long count;  // 0: no limit
  double timeout_s;     // 0: no limit
};

static volatile sig_atomic_t stopped = 0;
static void stop(int signal_number) {
  (void)signal_number;
  stopped = 1;
}

static void print_stamp(const builtin_interfaces_msg_dds__Time_* t) {
  printf("[%" PRId32 ".%09" PRIu32 "] ", t->sec, t->nanosec);
}

static void print_pose(const geometry_msgs_msg_dds__Pose_* pose) {
  printf("p = %.4f %.4f %.4f m, q(xyzw) = %.4f %.4f %.4f %.4f", pose->position.x, pose->position.y, pose->position.z,
         pose->orientation.x, pose->orientation.y, pose->orientation.z, pose->orientation.w);
}

static void print_joint_states(const void* sample) {
  const sensor_msgs_msg_dds__JointState_* s = sample;
  print_stamp(&s->header.stamp);
  printf("joint states:");
  for (uint32_t i = 0; i < s->name._length && i < s->position._length; ++i)
    printf(" %s %.4f", s->name._buffer[i], s->position._buffer[i]);
  printf("\n");
}

static void print_hand_pose(const void* sample) {
  const geometry_msgs_msg_dds__PoseStamped_* s = sample;
  print_stamp(&s->header.stamp);
  printf("hand pose in %s: ", s->header.frame_id);
  print_pose(&s->pose);
  printf("\n");
}

static void print_hand_state(const void* sample) {
  const embody_msgs_msg_dds__HandState_* s = sample;
  printf("[%" PRId64 ".%09" PRId64 "] hand state %" PRIu64 "%s: ", s->capture_ns / 1000000000,
         s->capture_ns % 1000000000, s->frame_number, s->valid ? "" : " (invalid)");
  print_pose(&s->pose);
  printf(", residual");
  for (int finger = 0; finger < 5; ++finger) printf(" %.1f", 1e3 * s->residual_m[finger]);
  printf(" mm, confidence %.2f\n", s->hand_confidence);
}

static void print_hand_telemetry(const void* sample) {
  const embody_msgs_msg_dds__HandTelemetry_* s = sample;
  printf("[%" PRId64 ".%09" PRId64 "] robot hand %s, supply %s:", s->arrival_ns / 1000000000,
         s->arrival_ns % 1000000000, s->condition, s->supply);
  const dds_sequence_double* current = s->current_a._length > 0 ? &s->current_a : &s->current_raw;
  for (uint32_t i = 0; i < s->joint._length; ++i) {
    printf(" %s %.3f rad", s->joint._buffer[i], s->position_rad._buffer[i]);
    if (i < current->_length) printf(" %.2f%s", current->_buffer[i], s->current_a._length > 0 ? " A" : " (raw)");
  }
  for (uint32_t i = 0; i < s->force._length; ++i)
    printf(" force%u=%d/%d", s->force._buffer[i].finger, s->force._buffer[i].normal, s->force._buffer[i].tangential);
  printf("%s%s\n", s->why_not[0] != '\0' ? "; " : "", s->why_not);
}

static void print_markers(const void* sample) {
  static const char* const kVerdicts[] = {"none", "missing", "used", "relabelled", "jumped", "ghost"};
  const embody_msgs_msg_dds__Markers_* s = sample;
  printf("[%" PRId64 ".%09" PRId64 "] markers %" PRIu64 ":", s->capture_ns / 1000000000, s->capture_ns % 1000000000,
         s->frame_number);
  for (uint32_t i = 0; i < s->markers._length; ++i) {
    const embody_msgs_msg_dds__Marker_* m = &s->markers._buffer[i];
    printf(" %s %s", m->name, m->verdict < 6 ? kVerdicts[m->verdict] : "?");
  }
  if (s->back[0] != '\0') printf(", back %s (%.1f mm)", s->back, 1e3 * s->back_fit_error_m);
  for (uint32_t i = 0; i < s->findings._length; ++i) printf("; %s", s->findings._buffer[i]);
  printf("\n");
}

static void print_status(const void* sample) {
  const embody_msgs_msg_dds__Status_* s = sample;
  print_stamp(&s->stamp);
  printf("status: %s", s->mode);
  if (s->cause[0] != '\0') printf(" (%s)", s->cause);
  for (uint32_t i = 0; i < s->rates._length; ++i)
    printf(" %s=%.1fHz", s->rates._buffer[i].name, s->rates._buffer[i].rate_hz);
  for (uint32_t i = 0; i < s->latencies._length; ++i)
    printf(" %s=%.0f/%.0fus", s->latencies._buffer[i].name, s->latencies._buffer[i].p50_us,
           s->latencies._buffer[i].p99_us);
  for (uint32_t i = 0; i < s->counters._length; ++i)
    printf(" %s=%" PRIu64, s->counters._buffer[i].name, s->counters._buffer[i].value);
  printf("\n");
}

struct topic {
  const char* name;  // after rt/embody/
  bool has_side;
  const dds_topic_descriptor_t* type;
  void (*print)(const void* sample);
};

static const struct topic kTopicList[kTopics] = {
    {"joint_states", true, &sensor_msgs_msg_dds__JointState__desc, print_joint_states},
    {"hand_pose", true, &geometry_msgs_msg_dds__PoseStamped__desc, print_hand_pose},
    {"hand_state", true, &embody_msgs_msg_dds__HandState__desc, print_hand_state},
    {"hand_telemetry", true, &embody_msgs_msg_dds__HandTelemetry__desc, print_hand_telemetry},
    {"markers", true, &embody_msgs_msg_dds__Markers__desc, print_markers},
    {"status", false, &embody_msgs_msg_dds__Status__desc, print_status},
};

static dds_entity_t open_reader(dds_entity_t participant, const struct topic* topic, const char* side) {
  char name[256];
  if (topic->has_side)
    snprintf(name, sizeof name, "rt/embody/%s/%s", side, topic->name);
  else
    snprintf(name, sizeof name, "rt/embody/%s", topic->name);
  const dds_entity_t entity = dds_create_topic(participant, topic->type, name, NULL, NULL);
  if (entity < 0) return entity;
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, 0);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
  const dds_entity_t reader = dds_create_reader(participant, entity, qos, NULL);
  dds_delete_qos(qos);
  return reader;
}

// Takes and prints what `reader` holds, at most `limit` samples (0: all). Returns how many.
static unsigned long print_all(dds_entity_t reader, void (*print)(const void*), unsigned long limit) {
  unsigned long printed = 0;
  for (;;) {
    void* samples[kBatch] = {NULL};
    dds_sample_info_t infos[kBatch];
    const unsigned long room = limit == 0 ? kBatch : limit - printed;
    const uint32_t size = room < kBatch ? (uint32_t)room : kBatch;
    if (size == 0) return printed;
    const int32_t taken = dds_take(reader, samples, infos, size, size);
    for (int32_t i = 0; i < taken; ++i) {
      if (!infos[i].valid_data) continue;  // a publisher left: news without a sample
      print(samples[i]);
      ++printed;
    }
    if (taken <= 0) return printed;
    (void)dds_return_loan(reader, samples, taken);
  }
}

static unsigned long print_until_done(const dds_entity_t* readers, dds_entity_t waitset,
                                      const struct options* options) {
  const dds_time_t end = dds_time() + (dds_time_t)(options->timeout_s * 1e9);
  unsigned long printed = 0;
  while (!stopped && (options->timeout_s <= 0 || dds_time() < end)) {
    (void)dds_waitset_wait(waitset, NULL, 0, 100 * 1000000);
    for (int i = 0; i < kTopics; ++i) {
      const unsigned long left = options->count == 0 ? 0 : options->count - printed;
      printed += print_all(readers[i], kTopicList[i].print, left);
      if (options->count != 0 && printed >= options->count) return printed;
    }
    fflush(stdout);
  }
  return printed;
}

static int run(const struct options* options) {
  if (getenv("CYCLONEDDS_URI") == NULL) (void)dds_create_domain(options->domain, kLoopbackOnly);
  const dds_entity_t participant = dds_create_participant(options->domain, NULL, NULL);
  if (participant < 0) {
    fprintf(stderr, "cannot join DDS domain %" PRIu32 ": %s\n", options->domain, dds_strretcode(participant));
    return 1;
  }
  const dds_entity_t waitset = dds_create_waitset(participant);
  dds_entity_t readers[kTopics];
  for (int i = 0; i < kTopics; ++i) {
    readers[i] = open_reader(participant, &kTopicList[i], options->side);
    if (readers[i] < 0) {
      fprintf(stderr, "cannot read topic %s: %s\n", kTopicList[i].name, dds_strretcode(readers[i]));
      return 1;
    }
    dds_set_status_mask(readers[i], DDS_DATA_AVAILABLE_STATUS);
    dds_waitset_attach(waitset, readers[i], i);
  }
  return print_until_done(readers, waitset, options) > 0 ? 0 : 1;
}

static int usage(void) {
  fprintf(stderr, "usage: embody-dds-subscriber [--domain N] [--side SIDE] [--count N] [--timeout SECONDS]\n");
  return 2;
}

int main(int argc, char** argv) {
  struct options options = {0, "right", 0, 0.0};
  const struct option names[] = {{"domain", required_argument, NULL, 'd'},
                                 {"side", required_argument, NULL, 's'},
                                 {"count", required_argument, NULL, 'c'},
                                 {"timeout", required_argument, NULL, 't'},
                                 {NULL, 0, NULL, 0}};
  for (int option; (option = getopt_long(argc, argv, "", names, NULL)) != -1;) {
    char* end = NULL;
    switch (option) {
      case 'd':
        options.domain = (dds_domainid_t)strtoul(optarg, &end, 10);
        break;
      case 's':
        options.side = optarg;
        break;
      case 'c':
        options.count = strtoul(optarg, &end, 10);
        break;
      case 't':
        options.timeout_s = strtod(optarg, &end);
        break;
      default:
        return usage();
    }
    if (end != NULL && (end == optarg || *end != '\0')) return usage();
  }
  if (optind != argc) return usage();
  signal(SIGINT, stop);
  signal(SIGTERM, stop);
  const int code = run(&options);
  dds_delete(DDS_CYCLONEDDS_HANDLE);
  return code;
}
