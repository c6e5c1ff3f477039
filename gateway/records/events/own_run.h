// The start and the end of the gateway itself as events, once each; the start says how the previous
// run ended. No clock, and no lock: gateway/records/events/pending_events.h has it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "gateway/records/events/own_records.h"

namespace baudgate::events {

class OwnRun {
 public:
  void OnStarted(std::string version, WallTime at) {
    start_ = {std::move(version), at};
    ends_ = true;
  }
  /// The previous run, from the file.
  void OnOpened(const LastRun& before) { before_ = before; }

  bool waits() const { return start_.has_value(); }
  /// When opened.
  std::optional<EventRecord> TakeStart() {
    const auto start = std::exchange(start_, std::nullopt);
    if (!start) return std::nullopt;
    return StartRecord(start->version, before_, start->at);
  }
  std::optional<EventRecord> TakeEnd(WallTime at) {
    if (!std::exchange(ends_, false)) return std::nullopt;
    return EndRecord(at);
  }

 private:
  struct Start {
    std::string version;
    WallTime at{};
  };
  std::optional<Start> start_;  // to be told
  bool ends_ = false;           // to be told
  LastRun before_{};
};

}  // namespace baudgate::events
