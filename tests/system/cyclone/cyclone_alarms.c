// A subscriber to alarms on Cyclone DDS, for tests and as an example: knows baudgate only by its published IDL and
// topic name. The state of each alarm comes over loopback when this starts and whenever it changes, one a line:
//   seq line device name point state priority acknowledged_by text
// ("-" for an empty field). Ends with 0 when --count lines have come, 1 when that did not happen within --seconds.
// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>

#include "baudgate.h"
#include "cyclone_reader.h"

static const char* shown(const char* text) { return text[0] == 0 ? "-" : text; }

static bool show(const void* sample) {
  const baudgate_v1_AlarmState* s = sample;
  printf("%llu %s %s %s %s %u %u %s %s\n", (unsigned long long)s->seq, s->line, s->device, s->name,
         shown(s->point), (unsigned)s->state, (unsigned)s->priority, shown(s->acknowledged_by),
         s->text);
  return true;
}

int main(int argc, char** argv) {
  static baudgate_v1_AlarmState samples[BATCH];
  const struct topic alarms = {.program = "cyclone_alarms",
                               .what = "states",
                               .name = "baudgate/alarms",
                               .type = &baudgate_v1_AlarmState_desc,
                               .depth = 1,
                               .instances = 10000,
                               .samples = (char*)samples,
                               .size = sizeof samples[0],
                               .show = show};
  return read_topic(argc, argv, &alarms);
}
