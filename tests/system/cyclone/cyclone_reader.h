// Helper of the subscribers on Cyclone DDS. A subscriber reads a topic over loopback, first its
// history, then new samples, and prints one line per sample. It ends after --count printed lines
// (exit code 0) or after --seconds (exit code 1).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "dds/dds.h"

#define BATCH 64

struct topic {
  const char* program;
  const char* what;
  const char* name;
  const dds_topic_descriptor_t* type;
  int32_t depth;  // history of each instance
  int32_t instances;
  char* samples;  // array of BATCH samples
  size_t size;
  // Prints a sample; returns false if the sample does not count for --count.
  bool (*show)(const void* sample);
};

int read_topic(int argc, char** argv, const struct topic* topic);
