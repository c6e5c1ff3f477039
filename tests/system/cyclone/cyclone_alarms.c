// A subscriber to alarms on Cyclone DDS, for tests and as an example: knows baudgate only by its published IDL and
// topic name. The state of each alarm comes over loopback when this starts and whenever it changes, one a line:
//   seq line device name point state priority acknowledged_by text
// ("-" for an empty field). Ends with 0 when --count lines have come, 1 when that did not happen within --seconds.
// SPDX-License-Identifier: Apache-2.0
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "baudgate.h"
#include "dds/dds.h"

#define BATCH 64
#define ALARMS 10000

static const char kConfiguration[] =
    "<CycloneDDS><Domain><General>"
    "<Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<Peers><Peer address='127.0.0.1'/></Peers></Discovery>"
    "</Domain></CycloneDDS>";

static dds_entity_t create_reader(dds_entity_t participant) {
  dds_entity_t topic =
      dds_create_topic(participant, &baudgate_v1_AlarmState_desc, "baudgate/alarms", NULL, NULL);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_resource_limits(qos, ALARMS, ALARMS, 1);
  dds_entity_t reader = dds_create_reader(participant, topic, qos, NULL);
  dds_delete_qos(qos);
  return reader;
}

static const char* shown(const char* text) { return text[0] == 0 ? "-" : text; }

// True when `count` have come.
static bool take(dds_entity_t reader, int count) {
  static baudgate_v1_AlarmState samples[BATCH];
  static int known = 0;
  void* pointers[BATCH];
  dds_sample_info_t infos[BATCH];
  for (int i = 0; i < BATCH; ++i) pointers[i] = &samples[i];
  int taken = 0;
  while ((taken = dds_take(reader, pointers, infos, BATCH, BATCH)) > 0) {
    for (int i = 0; i < taken; ++i) {
      if (!infos[i].valid_data) continue;
      const baudgate_v1_AlarmState* s = &samples[i];
      ++known;
      printf("%llu %s %s %s %s %u %u %s %s\n", (unsigned long long)s->seq, s->line, s->device,
             s->name, shown(s->point), (unsigned)s->state, (unsigned)s->priority,
             shown(s->acknowledged_by), s->text);
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
    fprintf(stderr, "cyclone_alarms: %s\n", dds_strretcode(-participant));
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
  if (!done) fprintf(stderr, "cyclone_alarms: fewer than %d states came\n", count);
  return done ? 0 : 1;
}
