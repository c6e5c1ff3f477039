// `LineControl` acts on lines while they run: lends a port, takes a device out of use, watches the
// bytes. gateway/lines/lines.h implements it; gateway/outputs/control (the local socket) uses it.
// All functions are thread-safe. `line` and `device` are numbers in the point store.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/line.h"
#include "gateway/base/time.h"
#include "gateway/records/trace/trace_text.h"

namespace baudgate::protocols {
struct Protocol;
}  // namespace baudgate::protocols

namespace baudgate::lines {

// The text that the status of a line shows for its port until the first attempt to open the port.

inline constexpr std::string_view kNotOpenedYet = "not opened yet";

class LineControl {
 public:
  virtual ~LineControl() = default;
  /// Closes the port for another program, and opens it again after `time`; a second call restarts
  /// the time. Meanwhile the points of the line are out of service.
  virtual void Release(std::uint32_t line, Duration time) = 0;
  /// Lets network clients use the port for `time`; a second call replaces the first. The points of
  /// the line are out of service while a client uses the port.
  virtual void Offer(std::uint32_t line, config::PortServer server, Duration time) = 0;
  virtual void TakeBack(std::uint32_t line) = 0;
  /// Takes a device into or out of use. A device out of use is not polled, and its points are out
  /// of service. A restart forgets this; `enabled: false` in the configuration lasts. `by`: the
  /// client (DeviceStatus::disabled_by).
  virtual void SetInUse(std::uint32_t device, bool in_use, const std::string& by = {}) = 0;
  /// Returns null if the protocol is not installed.
  virtual const protocols::Protocol* FindProtocol(const std::string& /*name*/) const {
    return nullptr;
  }
  /// Returns a queue that receives each new trace record of the line until the caller drops the
  /// queue (records::TraceQueue limits its length); null if the line has ended. The line's thread
  /// calls `wake` when the empty queue gets its first record; `wake` must not block.
  virtual std::shared_ptr<records::TraceQueue> Trace(std::uint32_t line,
                                                     std::function<void()> wake) = 0;
  /// Returns the records in the flight recorder of the line, oldest first.
  virtual std::vector<records::TraceRecord> Recorded(std::uint32_t line) = 0;
};

}  // namespace baudgate::lines
