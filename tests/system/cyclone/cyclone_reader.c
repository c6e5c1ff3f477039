// SPDX-License-Identifier: Apache-2.0
#include "cyclone_reader.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char kConfiguration[] =
    "<CycloneDDS><Domain><General>"
    "<Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<Peers><Peer address='127.0.0.1'/></Peers></Discovery>"
    "</Domain></CycloneDDS>";

static dds_entity_t create_reader(dds_entity_t participant, const struct topic* of) {
  dds_entity_t topic = dds_create_topic(participant, of->type, of->name, NULL, NULL);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, of->depth);
  dds_qset_resource_limits(qos, of->instances * of->depth, of->instances, of->depth);
  dds_entity_t reader = dds_create_reader(participant, topic, qos, NULL);
  dds_delete_qos(qos);
  return reader;
}

// How many of them are news.
static int take(dds_entity_t reader, const struct topic* of) {
  void* pointers[BATCH];
  dds_sample_info_t infos[BATCH];
  for (int i = 0; i < BATCH; ++i) pointers[i] = of->samples + (size_t)i * of->size;
  int news = 0;
  int taken = 0;
  while ((taken = dds_take(reader, pointers, infos, BATCH, BATCH)) > 0) {
    for (int i = 0; i < taken; ++i) {
      if (infos[i].valid_data && of->show(pointers[i])) ++news;
    }
    fflush(stdout);
  }
  return news;
}

int read_topic(int argc, char** argv, const struct topic* topic) {
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
    fprintf(stderr, "%s: %s\n", topic->program, dds_strretcode(-participant));
    return 1;
  }
  dds_entity_t reader = create_reader(participant, topic);
  dds_entity_t waitset = dds_create_waitset(participant);
  const dds_entity_t condition = dds_create_readcondition(reader, DDS_ANY_STATE);
  int known = 0;
  bool done = false;
  if (reader > 0 && dds_waitset_attach(waitset, condition, 0) == DDS_RETCODE_OK) {
    const dds_time_t deadline = dds_time() + DDS_SECS(seconds);
    while (!done && dds_time() < deadline) {
      dds_waitset_wait_until(waitset, NULL, 0, deadline);
      known += take(reader, topic);
      done = known >= count;
    }
  }
  dds_delete(participant);
  if (!done) fprintf(stderr, "%s: fewer than %d %s came\n", topic->program, count, topic->what);
  return done ? 0 : 1;
}
