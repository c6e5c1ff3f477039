// A subscriber to events on Cyclone DDS, for tests and as an example: knows baudgate only by its published IDL and
// topic name. Events of any gateway of the domain come over loopback and go to standard output, one a line:
//   seq device clock_quality channel code text
// What it has seen already (the gateway or its DDS process was started anew) it knows by seq, and passes over: "again SEQ".
// Ends with 0 when --count events have come, 1 when that did not happen within --seconds.
// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>

#include "baudgate.h"
#include "cyclone_reader.h"

// The events of one gateway.
static bool show(const void* sample) {
  static unsigned long long last = 0;
  const baudgate_v1_DeviceEvent* s = sample;
  if (s->seq <= last) {
    printf("again %llu\n", (unsigned long long)s->seq);
    return false;
  }
  last = s->seq;
  printf("%llu %s %u %u %u %s\n", (unsigned long long)s->seq, s->device,
         (unsigned)s->clock_quality, (unsigned)s->channel, (unsigned)s->code, s->text);
  return true;
}

int main(int argc, char** argv) {
  static baudgate_v1_DeviceEvent samples[BATCH];
  const struct topic events = {.program = "cyclone_events",
                               .what = "events",
                               .name = "baudgate/events",
                               .type = &baudgate_v1_DeviceEvent_desc,
                               .depth = 1000,
                               .instances = 100,
                               .samples = (char*)samples,
                               .size = sizeof samples[0],
                               .show = show};
  return read_topic(argc, argv, &events);
}
