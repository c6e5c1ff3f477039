// Where a line hands over events to be saved: implemented by gateway/daemon/event_path.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "config/model/line.h"
#include "gateway/bus/devices/poller_listener.h"

namespace baudgate {

/// On the threads of the lines; returns at once.
class EventSink {
 public:
  virtual ~EventSink() = default;
  /// See PollerListener::OnEvents.
  virtual void OnReported(ReportedEvents events) = 0;
  /// See PollerListener::OnDrained.
  virtual void OnDrained(std::uint32_t device, Instant asked) = 0;
  /// News of that line.
  virtual void OnNews(const config::Line& line, const News& news, Now at) = 0;
  /// See PollerListener::OnRead.
  virtual void OnRead(std::uint32_t device, std::span<const std::uint32_t> points, Now at) = 0;
};

}  // namespace baudgate
