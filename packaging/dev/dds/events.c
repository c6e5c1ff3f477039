// A subscriber of the events of baudgate on Cyclone DDS: prints each event once. After a restart of
// the gateway or of its DDS process, and after some reloads, the last 1,000 events come again, and
// events of different devices may come in another order than they happened. So the largest number is
// remembered for each gateway and device.
//   events [domain]
// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "baudgate.h"
#include "dds/dds.h"

#define MOST_DEVICES 1000
#define DEPTH 1000
#define BATCH 256

struct seen {
  char gateway[65];
  char device[65];  // empty: events of the gateway itself, or of a port
  unsigned long long seq;
};

// The place of this device in the table; NULL: there are more than MOST_DEVICES.
static struct seen* find(const baudgate_v1_DeviceEvent* event) {
  static struct seen table[MOST_DEVICES];
  static int used = 0;
  for (int i = 0; i < used; ++i) {
    if (strcmp(table[i].gateway, event->gateway) == 0 && strcmp(table[i].device, event->device) == 0) {
      return &table[i];
    }
  }
  if (used == MOST_DEVICES) return NULL;
  struct seen* seen = &table[used++];
  snprintf(seen->gateway, sizeof seen->gateway, "%s", event->gateway);
  snprintf(seen->device, sizeof seen->device, "%s", event->device);
  return seen;
}

int main(int argc, char** argv) {
  const dds_domainid_t domain = argc > 1 ? (dds_domainid_t)atoi(argv[1]) : 0;
  dds_entity_t participant = dds_create_participant(domain, NULL, NULL);
  if (participant < 0) {
    fprintf(stderr, "events: no participant: %s\n", dds_strretcode(-participant));
    return 1;
  }
  dds_entity_t topic =
      dds_create_topic(participant, &baudgate_v1_DeviceEvent_desc, "baudgate/events", NULL, NULL);

  // Reliable and transient local, with room for as many events of a device as a gateway sends to a
  // subscriber that comes late.
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, DEPTH);
  dds_qset_resource_limits(qos, MOST_DEVICES * DEPTH, MOST_DEVICES, DEPTH);
  dds_entity_t reader = dds_create_reader(participant, topic, qos, NULL);
  dds_delete_qos(qos);
  dds_entity_t waitset = dds_create_waitset(participant);
  dds_waitset_attach(waitset, dds_create_readcondition(reader, DDS_ANY_STATE), 0);

  static baudgate_v1_DeviceEvent events[BATCH];
  void* pointers[BATCH];
  dds_sample_info_t infos[BATCH];
  for (int i = 0; i < BATCH; ++i) pointers[i] = &events[i];
  for (;;) {
    dds_waitset_wait(waitset, NULL, 0, DDS_INFINITY);
    const int taken = dds_take(reader, pointers, infos, BATCH, BATCH);
    for (int i = 0; i < taken; ++i) {
      if (!infos[i].valid_data) continue;  // the gateway has left
      const baudgate_v1_DeviceEvent* event = &events[i];
      struct seen* seen = find(event);
      if (seen != NULL && event->seq <= seen->seq) continue;  // it came before
      if (seen != NULL) seen->seq = event->seq;
      printf("%s %llu %s channel %u: %s\n", event->gateway, (unsigned long long)event->seq, event->device,
             event->channel, event->text);
    }
    fflush(stdout);
  }
}
