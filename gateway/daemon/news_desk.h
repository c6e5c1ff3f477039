// What of a line's states is news: a device that does not answer, a port that is down. What begins
// is told once, its end where the beginning was, and the first time (News::first). Of
// gateway/daemon/line_driver.h.
//
//   device online → offline           no_answer
//   port lost, opened                 port_down, port_down over
//   that device offline → online      no_answer over; of all others only the first (News::first)
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "config/model/line.h"
#include "gateway/daemon/event_sink.h"
#include "gateway/store/device_status.h"

namespace baudgate {

class NewsDesk {
 public:
  /// Both outlive it; without a sink it does nothing.
  NewsDesk(const config::Line& line, EventSink* sink) : line_(line), sink_(sink) {}

  void OnDeviceState(std::uint32_t device, DeviceState from, DeviceState to,
                     const std::string& reason, Now now);
  void Tell(News news, Now now);

 private:
  const config::Line& line_;
  EventSink* const sink_;
  using Key = std::pair<News::What, std::optional<std::uint32_t>>;
  std::set<Key> told_;  // and not over
  std::set<Key> over_;  // was said once
};

}  // namespace baudgate
