// What subscribers on Cyclone DDS have in common: over loopback, all that a topic has kept and what
// comes, one line a sample, until --count lines of news have come (0) or --seconds have passed (1).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "dds/dds.h"

#define BATCH 64

struct topic {
  const char* program;  // for messages
  const char* what;     // "events"
  const char* name;     // of the topic
  const dds_topic_descriptor_t* type;
  int32_t depth;  // of each instance
  int32_t instances;
  char* samples;                     // BATCH of them
  size_t size;                       // of one
  bool (*show)(const void* sample);  // prints it; false: it is no news
};

// The exit code.
int read_topic(int argc, char** argv, const struct topic* topic);
