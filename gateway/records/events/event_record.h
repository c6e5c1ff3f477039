// One event as it is kept for ever. docs/events.md has the fields for users. On its way an event is
// a DeviceEvent in an EventBatch (protocols), ReportedEvents (poll), an EventRecord in a Batch
// (here), and a FedEvent for outputs.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/model/device.h"
#include "gateway/base/time.h"
#include "gateway/records/events/alarm.h"
#include "gateway/records/events/kept_record.h"
#include "gateway/records/events/placed_time.h"
#include "protocols/conversation.h"

namespace baudgate::events {

struct EventRecord {
  std::int64_t seq = 0;  ///< from 1 on without a gap, over restarts; 0: it is not in the file yet
  WallTime received{};
  WallTime device_time{};
  ClockQuality clock = ClockQuality::none;
  std::string line;
  std::string device;
  std::uint32_t channel = 0;
  std::uint32_t code = 0;
  config::EventState state = config::EventState::message;
  std::string text;
  /// In an event of the gateway: the part of the device, "current_l1 above 5"; not in the file.
  /// Also the name of its alarm.
  std::string subject{};
  AlarmMark mark{};
  /// The name of the values that belong to it: they are in `kept`, or still to be read. Empty:
  /// none.
  std::string record{};
  std::optional<KeptRecord> kept{};  ///< written with it, in one transaction
  std::optional<Alarm> alarm{};  ///< its state after this event; empty: as before, or there is none
};

/// Longer texts are cut.
inline constexpr std::size_t kLongestText = 128;

/// Cuts to kLongestText, without half a character at the end.
void Shorten(std::string& text);

/// Makes records with the texts of the device's profile. `oldest`: see Place.
std::vector<EventRecord> RecordsOf(const EventBatch& batch, const std::string& line,
                                   const config::Device& device, WallTime received,
                                   std::optional<Duration> oldest);

}  // namespace baudgate::events
