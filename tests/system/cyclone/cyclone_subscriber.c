// A subscriber on Cyclone DDS, for tests: knows baudgate only by its published IDL and topic names.
// Samples come from any gateway of the domain over loopback and go to standard output, one a line:
//   device point value quality unit      and when it has left:   gone device point
//   gateway name start_time_ns version
// CYCLONEDDS_URI overrides its settings; --multicast has it announce a group, as it does by default
// on any network but loopback.
// --qos POLICY asks for what the gateway does not offer (policies[] below).
// Ends with 0 when --count distinct points have arrived (with --gone: and left again) and a gateway
// has told of itself, 1 when that did not happen within --seconds.
// SPDX-License-Identifier: Apache-2.0
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "baudgate.h"
#include "dds/dds.h"

#define BATCH 256
#define MOST_INSTANCES 100000

struct options {
  int domain;
  int count;
  int seconds;
  bool until_gone;
  bool multicast;
  const char* peer;
  const char* policy;
};

static void ask_deadline(dds_qos_t* qos) { dds_qset_deadline(qos, DDS_SECS(5)); }
static void ask_exclusive(dds_qos_t* qos) { dds_qset_ownership(qos, DDS_OWNERSHIP_EXCLUSIVE); }
static void ask_liveliness(dds_qos_t* qos) {
  dds_qset_liveliness(qos, DDS_LIVELINESS_AUTOMATIC, DDS_SECS(5));
}
static void ask_partition(dds_qos_t* qos) { dds_qset_partition1(qos, "plant"); }
static void ask_any_partition(dds_qos_t* qos) { dds_qset_partition1(qos, "*"); }
static void ask_transient(dds_qos_t* qos) { dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT); }
static void ask_order(dds_qos_t* qos) {
  dds_qset_destination_order(qos, DDS_DESTINATIONORDER_BY_SOURCE_TIMESTAMP);
}
static void ask_presentation(dds_qos_t* qos) {
  dds_qset_presentation(qos, DDS_PRESENTATION_TOPIC, true, true);
}
static void ask_xcdr2(dds_qos_t* qos) {
  dds_data_representation_id_t only = DDS_DATA_REPRESENTATION_XCDR2;
  dds_qset_data_representation(qos, 1, &only);
}

static const struct {
  const char* name;
  bool of_subscriber;  // not of the reader
  void (*ask)(dds_qos_t* qos);
} policies[] = {{"deadline", false, ask_deadline},        {"exclusive", false, ask_exclusive},
                {"liveliness", false, ask_liveliness},    {"partition", true, ask_partition},
                {"any_partition", true, ask_any_partition},
                {"transient", false, ask_transient},      {"order", false, ask_order},
                {"presentation", true, ask_presentation}, {"xcdr2", false, ask_xcdr2}};

// For readers (or subscribers) of the point topic.
static void ask(dds_qos_t* qos, const char* name, bool of_subscriber) {
  for (size_t i = 0; name != NULL && i < sizeof policies / sizeof policies[0]; ++i) {
    if (strcmp(policies[i].name, name) != 0) continue;
    if (policies[i].of_subscriber == of_subscriber) policies[i].ask(qos);
  }
}

struct seen {
  dds_instance_handle_t handle;
  bool gone;
};

// Multicast may be missing (containers, lo without the flag): ask the loopback address itself, or
// the discovery server at ADDRESS:PORT.
static const char kConfiguration[] =
    "<CycloneDDS><Domain><General>"
    "<Interfaces><NetworkInterface address='127.0.0.1' multicast='%s'/></Interfaces>"
    "<AllowMulticast>%s</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<Peers><Peer address='%s'/></Peers></Discovery>"
    "</Domain></CycloneDDS>";

static bool parse(int argc, char** argv, struct options* options) {
  for (int i = 1; i < argc; ++i) {
    if (strcmp(argv[i], "--gone") == 0) {
      options->until_gone = true;
      continue;
    }
    if (strcmp(argv[i], "--multicast") == 0) {
      options->multicast = true;
      continue;
    }
    if (i + 1 == argc) return false;
    if (strcmp(argv[i], "--peer") == 0) {
      options->peer = argv[++i];
      continue;
    }
    if (strcmp(argv[i], "--qos") == 0) {
      options->policy = argv[++i];
      continue;
    }
    char* end = NULL;
    const long number = strtol(argv[i + 1], &end, 10);
    if (*end != '\0' || number < 0 || number > 1000000) return false;
    if (strcmp(argv[i], "--domain") == 0) {
      options->domain = (int)number;
    } else if (strcmp(argv[i], "--count") == 0) {
      options->count = (int)number;
    } else if (strcmp(argv[i], "--seconds") == 0) {
      options->seconds = (int)number;
    } else {
      return false;
    }
    ++i;
  }
  return true;
}

static dds_entity_t create_reader(dds_entity_t participant, const dds_topic_descriptor_t* type,
                                  const char* name, const char* policy) {
  dds_entity_t topic = dds_create_topic(participant, type, name, NULL, NULL);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_resource_limits(qos, MOST_INSTANCES, MOST_INSTANCES, 1);
  ask(qos, policy, false);
  dds_qos_t* of_subscriber = dds_create_qos();
  ask(of_subscriber, policy, true);
  dds_entity_t subscriber = dds_create_subscriber(participant, of_subscriber, NULL);
  dds_entity_t reader = dds_create_reader(subscriber, topic, qos, NULL);
  dds_delete_qos(of_subscriber);
  dds_delete_qos(qos);
  return reader;
}

static struct seen* find(struct seen* seen, int* known, dds_instance_handle_t handle) {
  for (int i = 0; i < *known; ++i) {
    if (seen[i].handle == handle) return &seen[i];
  }
  if (*known == MOST_INSTANCES) return NULL;
  seen[*known] = (struct seen){handle, false};
  return &seen[(*known)++];
}

// True once a gateway has told of itself.
static bool take_gateway(dds_entity_t reader) {
  static baudgate_v1_GatewayStatus sample;
  void* pointer = &sample;
  dds_sample_info_t info;
  if (dds_take(reader, &pointer, &info, 1, 1) != 1 || !info.valid_data) return false;
  printf("gateway %s %lld %s\n", sample.gateway, (long long)sample.start_time_ns, sample.version);
  return true;
}

// Reads until all of `options` has been met. Static memory: 100,000 entries are too many for a
// stack.
static bool listen_until_done(dds_entity_t reader, dds_entity_t gateways, dds_entity_t waitset,
                              const struct options* options) {
  static struct seen seen[MOST_INSTANCES];
  static baudgate_v1_PointSample samples[BATCH];
  int known = 0;
  int gone = 0;
  bool told = false;
  void* pointers[BATCH];
  dds_sample_info_t infos[BATCH];
  for (int i = 0; i < BATCH; ++i) pointers[i] = &samples[i];
  const dds_time_t deadline = dds_time() + DDS_SECS(options->seconds);
  while (dds_time() < deadline) {
    dds_waitset_wait_until(waitset, NULL, 0, deadline);
    int taken = 0;
    while ((taken = dds_take(reader, pointers, infos, BATCH, BATCH)) > 0) {
      for (int i = 0; i < taken; ++i) {
        struct seen* entry = find(seen, &known, infos[i].instance_handle);
        if (entry == NULL) return false;
        const baudgate_v1_PointSample* s = &samples[i];
        if (infos[i].valid_data) {
          printf("%s %s %.17g %u %s\n", s->device, s->point, s->value, s->quality, s->unit);
        }
        if (infos[i].instance_state != DDS_ALIVE_INSTANCE_STATE && !entry->gone) {
          entry->gone = true;
          ++gone;
          printf("gone %s %s\n", s->device, s->point);
        }
      }
    }
    told = take_gateway(gateways) || told;
    fflush(stdout);
    if (told && known >= options->count && (!options->until_gone || gone >= options->count))
      return true;
  }
  fprintf(stderr, "cyclone_subscriber: %d points arrived, %d left, gateway told: %d\n", known, gone,
          told);
  return false;
}

static bool attach(dds_entity_t waitset, dds_entity_t reader) {
  const dds_entity_t condition = dds_create_readcondition(reader, DDS_ANY_STATE);
  return dds_waitset_attach(waitset, condition, 0) == DDS_RETCODE_OK;
}

int main(int argc, char** argv) {
  struct options options = {0, 1, 20, false, false, "127.0.0.1", NULL};
  if (!parse(argc, argv, &options)) {
    fprintf(stderr,
            "usage: cyclone_subscriber [--domain N] [--count K] [--seconds S] [--gone] "
            "[--multicast] [--peer P] [--qos POLICY]\n");
    return 2;
  }
  char configuration[sizeof kConfiguration + 64];
  const char* multicast = options.multicast ? "true" : "false";
  snprintf(configuration, sizeof configuration, kConfiguration, multicast, multicast, options.peer);
  setenv("CYCLONEDDS_URI", configuration, 0);
  dds_entity_t participant = dds_create_participant((dds_domainid_t)options.domain, NULL, NULL);
  if (participant < 0) {
    fprintf(stderr, "cyclone_subscriber: %s\n", dds_strretcode(-participant));
    return 1;
  }
  dds_entity_t reader =
      create_reader(participant, &baudgate_v1_PointSample_desc, "baudgate/points", options.policy);
  dds_entity_t gateways =
      create_reader(participant, &baudgate_v1_GatewayStatus_desc, "baudgate/gateways", NULL);
  dds_entity_t waitset = dds_create_waitset(participant);
  const bool ready =
      reader > 0 && gateways > 0 && attach(waitset, reader) && attach(waitset, gateways);
  const bool done = ready && listen_until_done(reader, gateways, waitset, &options);
  dds_delete(participant);
  return done ? 0 : 1;
}
