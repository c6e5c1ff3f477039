// A client that writes, on Cyclone DDS, for tests: knows baudgate only by its published IDL and
// topic names. It asks --count times with seq, seq + 1, …, each --repeat times, and waits for the
// reply to each before it goes on, asking again every two seconds. With --once it asks only once,
// --pause seconds after it has matched, and says so on standard error. Replies go to standard
// output, one a line:
//   SEQ OUTCOME REASON
// With --flood it asks without waiting, then prints what comes. With --early its writer is transient
// local and asks at once, whether a gateway is there or not; then it prints "matched" when one is.
// Ends with 0 when all replies have come, 1 when that did not happen within --seconds.
// SPDX-License-Identifier: Apache-2.0
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "baudgate.h"
#include "dds/dds.h"

struct options {
  long domain, count, repeat, seconds, deadline_ms, not_after_s, pause;
  unsigned long long seq;
  bool confirm, flood, early, once, not_after;
  baudgate_v1_WriteRequest request;
};

// See cyclone_subscriber.c.
static const char kConfiguration[] =
    "<CycloneDDS><Domain><General>"
    "<Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<Peers><Peer address='127.0.0.1'/></Peers></Discovery>"
    "</Domain></CycloneDDS>";

static bool parse_flag(const char* word, struct options* o) {
  if (strcmp(word, "--confirm") == 0) return o->confirm = true;
  if (strcmp(word, "--flood") == 0) return o->flood = true;
  if (strcmp(word, "--early") == 0) return o->early = true;
  if (strcmp(word, "--once") == 0) return o->once = true;
  return false;
}

static bool parse_word(const char* word, const char* value, struct options* o) {
  const struct {
    const char* word;
    char* to;
    size_t size;
  } texts[] = {{"--gateway", o->request.gateway, sizeof o->request.gateway},
               {"--client", o->request.client, sizeof o->request.client},
               {"--device", o->request.device, sizeof o->request.device},
               {"--point", o->request.point, sizeof o->request.point},
               {"--text", o->request.text, sizeof o->request.text}};
  for (size_t i = 0; i < sizeof texts / sizeof texts[0]; ++i) {
    if (strcmp(word, texts[i].word) != 0) continue;
    snprintf(texts[i].to, texts[i].size, "%s", value);
    return true;
  }
  const struct {
    const char* word;
    long* to;
  } numbers[] = {{"--domain", &o->domain},   {"--count", &o->count},
                 {"--repeat", &o->repeat},   {"--seconds", &o->seconds},
                 {"--deadline", &o->deadline_ms}, {"--not-after", &o->not_after_s},
                 {"--pause", &o->pause}};
  for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; ++i) {
    if (strcmp(word, numbers[i].word) != 0) continue;
    *numbers[i].to = strtol(value, NULL, 10);
    o->not_after = o->not_after || numbers[i].to == &o->not_after_s;
    return true;
  }
  if (strcmp(word, "--seq") == 0) {
    o->seq = strtoull(value, NULL, 10);
    return true;
  }
  if (strcmp(word, "--value") == 0) {
    o->request.value = strtod(value, NULL);
    return true;
  }
  return false;
}

static bool parse(int argc, char** argv, struct options* o) {
  for (int i = 1; i < argc; ++i) {
    if (parse_flag(argv[i], o)) continue;
    if (i + 1 == argc || !parse_word(argv[i], argv[i + 1], o)) return false;
    ++i;
  }
  return true;
}

static dds_qos_t* qos_of(bool transient_local) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos,
                      transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
  return qos;
}

static bool matched(dds_entity_t writer, dds_entity_t reader) {
  dds_publication_matched_status_t written;
  dds_subscription_matched_status_t read;
  return dds_get_publication_matched_status(writer, &written) == DDS_RETCODE_OK &&
         dds_get_subscription_matched_status(reader, &read) == DDS_RETCODE_OK &&
         written.current_count > 0 && read.current_count > 0;
}

static bool ask(dds_entity_t writer, const struct options* o, long number) {
  static baudgate_v1_WriteRequest request;
  request = o->request;
  request.seq = o->seq + (unsigned long long)number;
  request.confirm = o->confirm;
  request.deadline_ms = (uint32_t)o->deadline_ms;
  if (o->not_after) request.not_after_ns = dds_time() + DDS_SECS((int64_t)o->not_after_s);
  return dds_write(writer, &request) == DDS_RETCODE_OK;
}

// How many of this client's have come that were said after `begin`, and whether `seq` is among them.
static long take(dds_entity_t reader, const struct options* o, dds_time_t begin,
                 unsigned long long seq, bool* came) {
  static baudgate_v1_WriteReply reply;
  void* pointer = &reply;
  dds_sample_info_t info;
  long count = 0;
  while (dds_take(reader, &pointer, &info, 1, 1) == 1) {
    if (!info.valid_data || strcmp(reply.client, o->request.client) != 0) continue;
    if (info.source_timestamp < begin) continue;  // kept for readers to come
    printf("%llu %s %s\n", (unsigned long long)reply.seq, reply.outcome, reply.reason);
    fflush(stdout);
    if (reply.seq == seq) *came = true;
    ++count;
  }
  return count;
}

static bool converse(dds_entity_t writer, dds_entity_t reader, const struct options* o) {
  const dds_time_t begin = dds_time();
  const dds_time_t end = begin + DDS_SECS((int64_t)o->seconds);
  bool came = false;
  if (o->early && !ask(writer, o, 0)) return false;
  while (!matched(writer, reader)) {
    if (dds_time() > end) return false;
    dds_sleepfor(DDS_MSECS(20));
  }
  printf("matched\n");
  fflush(stdout);
  if (o->early || o->flood) {
    for (long i = 0; o->flood && i < o->count; ++i) ask(writer, o, i);
    for (long left = o->count; left > 0 && dds_time() < end; dds_sleepfor(DDS_MSECS(5))) {
      left -= take(reader, o, begin, 0, &came);
    }
    return !o->early;
  }
  dds_sleepfor(DDS_SECS((int64_t)o->pause));
  for (long i = 0; i < o->count * o->repeat; ++i) {
    const long number = i / o->repeat;
    if (!ask(writer, o, number)) return false;
    if (o->once) fprintf(stderr, "cyclone_writer: has asked\n");
    dds_time_t again = dds_time() + DDS_SECS(2);
    for (came = false; !came; dds_sleepfor(DDS_MSECS(5))) {
      if (dds_time() > end) return false;
      if (!o->once && dds_time() > again) {
        fprintf(stderr, "cyclone_writer: asks again\n");
        again = dds_time() + DDS_SECS(2);
        if (!ask(writer, o, number)) return false;
      }
      take(reader, o, begin, o->seq + (unsigned long long)number, &came);
    }
  }
  return true;
}

int main(int argc, char** argv) {
  static struct options options = {.count = 1, .repeat = 1, .seconds = 20, .seq = 1};
  if (!parse(argc, argv, &options)) {
    fprintf(stderr, "usage: cyclone_writer --gateway G --client C --device D --point P …\n");
    return 2;
  }
  setenv("CYCLONEDDS_URI", kConfiguration, 1);
  dds_entity_t participant = dds_create_participant((dds_domainid_t)options.domain, NULL, NULL);
  if (participant < 0) {
    fprintf(stderr, "cyclone_writer: %s\n", dds_strretcode(-participant));
    return 1;
  }
  dds_entity_t requests = dds_create_topic(participant, &baudgate_v1_WriteRequest_desc,
                                           "baudgate/write", NULL, NULL);
  dds_entity_t replies = dds_create_topic(participant, &baudgate_v1_WriteReply_desc,
                                          "baudgate/write_reply", NULL, NULL);
  dds_entity_t reader = dds_create_reader(participant, replies, qos_of(true), NULL);
  dds_entity_t writer = dds_create_writer(participant, requests, qos_of(options.early), NULL);
  const bool done = reader > 0 && writer > 0 && converse(writer, reader, &options);
  dds_delete(participant);
  return done ? 0 : 1;
}
