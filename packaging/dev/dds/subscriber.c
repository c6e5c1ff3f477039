// A subscriber of baudgate on Cyclone DDS: prints every point, and again when it changes. Built from
// the IDL alone (CMakeLists.txt); settings of the network come from CYCLONEDDS_URI (cyclone.xml).
//   subscriber [domain]
// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>
#include <stdlib.h>

#include "baudgate.h"
#include "dds/dds.h"

#define MOST_POINTS 100000
#define BATCH 256

int main(int argc, char** argv) {
  const dds_domainid_t domain = argc > 1 ? (dds_domainid_t)atoi(argv[1]) : 0;
  dds_entity_t participant = dds_create_participant(domain, NULL, NULL);
  if (participant < 0) {
    fprintf(stderr, "subscriber: no participant: %s\n", dds_strretcode(-participant));
    return 1;
  }
  dds_entity_t topic =
      dds_create_topic(participant, &baudgate_v1_PointSample_desc, "baudgate/points", NULL, NULL);

  // Reliable, transient local, keep last 1: the latest value of every point, also of those that were
  // published before this program began. Room for all points of all gateways of the domain.
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_resource_limits(qos, MOST_POINTS, MOST_POINTS, 1);
  dds_entity_t reader = dds_create_reader(participant, topic, qos, NULL);
  dds_delete_qos(qos);
  dds_entity_t waitset = dds_create_waitset(participant);
  dds_waitset_attach(waitset, dds_create_readcondition(reader, DDS_ANY_STATE), 0);

  static baudgate_v1_PointSample samples[BATCH];
  void* pointers[BATCH];
  dds_sample_info_t infos[BATCH];
  for (int i = 0; i < BATCH; ++i) pointers[i] = &samples[i];
  for (;;) {
    dds_waitset_wait(waitset, NULL, 0, DDS_INFINITY);
    const int taken = dds_take(reader, pointers, infos, BATCH, BATCH);
    for (int i = 0; i < taken; ++i) {
      const baudgate_v1_PointSample* s = &samples[i];
      if (infos[i].instance_state != DDS_ALIVE_INSTANCE_STATE) {
        printf("%s %s %s: its gateway has left\n", s->gateway, s->device, s->point);
      } else if ((s->quality & 0xC0) == 0xC0) {  // an OPC quality; its high byte says why it is not good
        // `text` is not empty for texts, and for whole numbers that a double would round.
        if (s->text[0] != '\0') {
          printf("%s %s %s = %s %s\n", s->gateway, s->device, s->point, s->text, s->unit);
        } else {
          printf("%s %s %s = %.9g %s\n", s->gateway, s->device, s->point, s->value, s->unit);
        }
      } else {
        printf("%s %s %s: not good, quality 0x%04X\n", s->gateway, s->device, s->point, s->quality);
      }
    }
    fflush(stdout);
  }
}
