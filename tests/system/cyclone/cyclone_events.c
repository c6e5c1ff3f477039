// A subscriber to events on Cyclone DDS, for tests and as an example: knows baudgate only by its published IDL and
// topic name. Events of any gateway of the domain come over loopback and go to standard output, one a line:
//   seq device clock_quality channel code text
// What it has seen already (the gateway or its DDS process was started anew) it knows by seq, and passes over: "again SEQ".
// Ends with 0 when --count events have come, 1 when that did not happen within --seconds.
// SPDX-License-Identifier: Apache-2.0
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "baudgate.h"
#include "dds/dds.h"

#define BATCH 64
#define DEPTH 1000
#define DEVICES 100

static const char kConfiguration[] =
    "<CycloneDDS><Domain><General>"
    "<Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<Peers><Peer address='127.0.0.1'/></Peers></Discovery>"
    "</Domain></CycloneDDS>";

static dds_entity_t create_reader(dds_entity_t participant) {
  dds_entity_t topic =
      dds_create_topic(participant, &baudgate_v1_DeviceEvent_desc, "baudgate/events", NULL, NULL);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, DEPTH);
  dds_qset_resource_limits(qos, DEVICES * DEPTH, DEVICES, DEPTH);
  dds_entity_t reader = dds_create_reader(participant, topic, qos, NULL);
  dds_delete_qos(qos);
  return reader;
}

// Of one gateway. True when `count` have come.
static bool take(dds_entity_t reader, int count) {
  static baudgate_v1_DeviceEvent samples[BATCH];
  static unsigned long long last = 0;
  static int known = 0;
  void* pointers[BATCH];
  dds_sample_info_t infos[BATCH];
  for (int i = 0; i < BATCH; ++i) pointers[i] = &samples[i];
  int taken = 0;
  while ((taken = dds_take(reader, pointers, infos, BATCH, BATCH)) > 0) {
    for (int i = 0; i < taken; ++i) {
      if (!infos[i].valid_data) continue;
      const baudgate_v1_DeviceEvent* s = &samples[i];
      if (s->seq <= last) {
        printf("again %llu\n", (unsigned long long)s->seq);
        continue;
      }
      last = s->seq;
      ++known;
      printf("%llu %s %u %u %u %s\n", (unsigned long long)s->seq, s->device,
             (unsigned)s->clock_quality, (unsigned)s->channel, (unsigned)s->code, s->text);
    }
    fflush(stdout);
  }
  return known >= count;
}

int main(int argc, char** argv) {
  int domain = 0;
  int count = 1;
  int seconds = 20;
  for (int i = 1; i + 1 < argc; i += 2) {
    const int number = atoi(argv[i + 1]);
    if (strcmp(argv[i], "--domain") == 0) domain = number;
    if (strcmp(argv[i], "--count") == 0) count = number;
    if (strcmp(argv[i], "--seconds") == 0) seconds = number;
  }
  setenv("CYCLONEDDS_URI", kConfiguration, 1);
  dds_entity_t participant = dds_create_participant((dds_domainid_t)domain, NULL, NULL);
  if (participant < 0) {
    fprintf(stderr, "cyclone_events: %s\n", dds_strretcode(-participant));
    return 1;
  }
  dds_entity_t reader = create_reader(participant);
  dds_entity_t waitset = dds_create_waitset(participant);
  const dds_entity_t condition = dds_create_readcondition(reader, DDS_ANY_STATE);
  bool done = false;
  if (reader > 0 && dds_waitset_attach(waitset, condition, 0) == DDS_RETCODE_OK) {
    const dds_time_t deadline = dds_time() + DDS_SECS(seconds);
    while (!done && dds_time() < deadline) {
      dds_waitset_wait_until(waitset, NULL, 0, deadline);
      done = take(reader, count);
    }
  }
  dds_delete(participant);
  if (!done) fprintf(stderr, "cyclone_events: fewer than %d events came\n", count);
  return done ? 0 : 1;
}
