// What the poller keeps of each device and of the task under way; shared by the poller's own
// sources.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/poll/answer_order.h"
#include "gateway/poll/poller.h"

namespace baudgate {

/// `given` over the protocol's own times for these settings.
LineTimes TimesOf(const config::Timing& given, const Protocol& protocol,
                  const config::SerialSettings& serial);

/// A device of the line, as the poller sees it; or a slave that only transparent routes reach: that
/// has no configuration, no conversation and no place in store and schedule.
struct Poller::Device {
  std::uint32_t index = 0;  // see gateway/trace/tap.h
  std::size_t slot = 0;     // in devices_ and in the schedule
  std::uint8_t slave = 0;   // its address, where routes may reach it
  const config::Device* config = nullptr;
  const Protocol* protocol = nullptr;
  config::SerialSettings serial;
  LineTimes times;
  int retries = 0;
  bool in_use = true;
  std::unique_ptr<Conversation> conversation;
  DeviceHealth health;
  DeviceState shown = DeviceState::never_seen;
  std::unique_ptr<Work> parked;  // a task that the device asked to wait with
  Instant parked_until{};
  Duration late_drain{};  // how much longer than its drain time this device was seen to need
  Duration trail{};       // how long after good answers more bytes came from this device
  Bytes sender;  // what its replies say of who they are from; entries of one address share it
  AnswerOrder own_order;
  AnswerOrder* order = &own_order;  // what its answers may belong to; that of the first such entry
  std::uint32_t probe_index = 0;    // of that entry
  std::optional<Instant> unanswered;  // start of the first exchange since its last answer
  Instant late_until{};               // until then an answer to a failed request may still come
  Duration fast_wire{};               // line time of its last whole fast round
  bool told_late = false;             // the user has been warned of late_drain
  bool acquainted = false;            // it has answered a probe
  Bytes identify;        // the steady probe that was answered first, and the frame that it is
  Bytes identity;        // answered with ever since; empty: none yet
  Bytes other_identity;  // that it answered with of late, and how often in a row
  int other_seen = 0;
  int other_probes = 0;              // answered, since that one was
  std::optional<Instant> late_from;  // bytes from here on are the late answer to its last request
  bool answered = false;             // its last request had its reply: bytes after it are too many
  bool babbles = false;      // its last exchange was corrupt: bytes after it are the rest of that
  bool cut_short = false;    // or partial: alike
  bool round_clean = true;   // nothing has failed in the fast round under way
  Duration round_wire{};     // its line time so far
  int once_repeats = 0;      // since it was reached anew: of what is read once
  Duration busy{};           // line time that it has taken
  std::uint32_t missed = 0;  // of its periods
  std::optional<Duration> probe_wait;  // how long others waited for its last probe
  std::optional<Instant> probed_at;    // when that was sent
  Duration probe_gap{};                // since the one before
  bool told_second = false;            // the user has been warned of a second, different reply
  Bytes refused_read;                  // the last that a client has asked an absent slave for
  Instant refused_at{};                // and when

  /// Whose replies can not be told apart from its own.
  bool IsSame(const Device& other) const {
    return this == &other ||
           (!sender.empty() && sender == other.sender && protocol == other.protocol);
  }
  bool polled() const { return conversation != nullptr; }
  Duration WorstCase() const {
    return times.quiet + 32 * times.character + times.reply + times.drain + late_drain;
  }
};

/// One task on its way to its end: one exchange or several.
struct Poller::Work {
  Device* device = nullptr;
  Task task;
  std::optional<WriteCommand> command;
  std::size_t write = 0;               // index in command->writes
  std::optional<config::Group> group;  // of a poll
  bool last_of_round = false;
  Request request;
  bool sending = false;  // request waits for the line to be idle
  int attempts = 0;      // of the present request, beyond the first
  int steps = 0;
  int parkings = 0;                         // how often the device has asked to wait with it
  bool refresh = false;                     // reads back what a command has written
  ProbeBudget* budget = nullptr;            // that has allowed it: its device was absent
  std::optional<RouteQueue::Batch> routed;  // whom the reply goes to; no conversation takes part
  bool common = true;                       // any slave answers it, if only with an exception
  Bytes reply;                              // to them
  bool mute = false;                        // its end says nothing about the device
  AnswerOrder::Fingerprint sent = 0;        // of the present request
  bool safe = true;                         // no reply to an earlier one can pass for its own
  bool heard = false;                       // a reply of the device itself came, whatever it said
  Instant began{};
  Instant exchange_began{};
  Duration wire{};  // of its answered exchanges
  Answer answer;
  std::optional<ExchangeEnd> end;
  ExchangeEnd failure;  // that the present request repeats, and when that was
  Instant failed_at{};

  bool begun() const { return steps > 1 || attempts > 0; }
};

}  // namespace baudgate
