// Writes one point through baudgate, on Cyclone DDS, and prints what became of it. The gateway needs
// `dds: { write: allow }`, the device `write: allow`.
//   writer GATEWAY DEVICE POINT VALUE [domain]
// SPDX-License-Identifier: Apache-2.0
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "baudgate.h"
#include "dds/dds.h"

static bool matched(dds_entity_t writer, dds_entity_t reader) {
  dds_publication_matched_status_t written;
  dds_subscription_matched_status_t read;
  return dds_get_publication_matched_status(writer, &written) == DDS_RETCODE_OK &&
         dds_get_subscription_matched_status(reader, &read) == DDS_RETCODE_OK &&
         written.current_count > 0 && read.current_count > 0;
}

int main(int argc, char** argv) {
  if (argc < 5) {
    fprintf(stderr, "usage: writer GATEWAY DEVICE POINT VALUE [domain]\n");
    return 2;
  }
  const dds_domainid_t domain = argc > 5 ? (dds_domainid_t)atoi(argv[5]) : 0;
  dds_entity_t participant = dds_create_participant(domain, NULL, NULL);
  if (participant < 0) {
    fprintf(stderr, "writer: no participant: %s\n", dds_strretcode(-participant));
    return 1;
  }
  dds_entity_t requests =
      dds_create_topic(participant, &baudgate_v1_WriteRequest_desc, "baudgate/write", NULL, NULL);
  dds_entity_t replies =
      dds_create_topic(participant, &baudgate_v1_WriteReply_desc, "baudgate/write_reply", NULL, NULL);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 4);
  dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);  // else requests are denied: they might be old
  dds_entity_t writer = dds_create_writer(participant, requests, qos, NULL);
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_entity_t reader = dds_create_reader(participant, replies, qos, NULL);
  dds_delete_qos(qos);

  const dds_time_t end = dds_time() + DDS_SECS(15);
  while (!matched(writer, reader)) {
    if (dds_time() > end) {
      fprintf(stderr, "writer: no gateway that takes writes in domain %u\n", (unsigned)domain);
      return 1;
    }
    dds_sleepfor(DDS_MSECS(20));
  }

  static baudgate_v1_WriteRequest request;
  snprintf(request.gateway, sizeof request.gateway, "%s", argv[1]);
  snprintf(request.client, sizeof request.client, "example-%ld", (long)dds_time());
  snprintf(request.device, sizeof request.device, "%s", argv[2]);
  snprintf(request.point, sizeof request.point, "%s", argv[3]);
  snprintf(request.text, sizeof request.text, "%s", argv[4]);
  request.seq = 1;
  if (dds_write(writer, &request) != DDS_RETCODE_OK) return 1;

  static baudgate_v1_WriteReply reply;
  void* pointer = &reply;
  dds_sample_info_t info;
  while (dds_time() < end) {
    if (dds_take(reader, &pointer, &info, 1, 1) != 1) {
      dds_sleepfor(DDS_MSECS(10));
    } else if (info.valid_data && strcmp(reply.client, request.client) == 0) {
      printf("%s %s\n", reply.outcome, reply.reason);
      return strcmp(reply.outcome, "ok") == 0 ? 0 : 1;
    }
  }
  fprintf(stderr, "writer: no reply\n");
  return 1;
}
