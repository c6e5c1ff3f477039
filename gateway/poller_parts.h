// What the poller keeps of each device and of the task under way; shared by the poller's own
// sources.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/poller.h"

namespace baudgate {

/// A device of the line, as the poller sees it.
struct Poller::Device {
  std::uint32_t index = 0;  // in the point store
  std::size_t slot = 0;     // in devices_ and in the schedule
  const config::Device* config = nullptr;
  const Protocol* protocol = nullptr;
  config::SerialSettings serial;
  LineTimes times;
  int retries = 0;
  std::unique_ptr<Conversation> conversation;
  DeviceHealth health;
  DeviceState shown = DeviceState::never_seen;
  std::unique_ptr<Work> parked;  // a task that the device asked to wait with
  Instant parked_until{};
  Duration late_drain{};  // how much longer than its drain time this device was seen to need
  std::optional<Instant> unanswered;  // start of the first exchange since its last answer
  Instant late_until{};               // until then an answer to a failed request may still come
  Duration fast_wire{};               // line time of its last whole fast round
  bool told_late = false;             // the user has been warned of late_drain
  bool round_clean = true;            // nothing has failed in the fast round under way
  Duration round_wire{};              // of the fast round under way

  Duration WorstCase() const {
    return times.quiet + 32 * times.character + times.reply + times.drain + late_drain;
  }
};

/// One task on its way to its end: one exchange or several.
struct Poller::Work {
  Device* device = nullptr;
  Task task;
  std::optional<WriteCommand> command;
  std::size_t write = 0;  // index in command->writes
  bool fast = false;
  bool last_of_round = false;
  Request request;
  bool sending = false;  // request waits for the line to be idle
  int attempts = 0;      // of the present request, beyond the first
  int steps = 0;
  int parkings = 0;      // how often the device has asked to wait with it
  bool refresh = false;  // reads back what a command has written
  bool mute = false;     // its end says nothing about the device
  Instant began{};
  Instant exchange_began{};
  Answer answer;
  std::optional<ExchangeEnd> end;
};

}  // namespace baudgate
