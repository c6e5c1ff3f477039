// What may be done to lines while they run: lend a port, take a device out of use, look at the
// bytes. Implemented by gateway/lines/lines.h, used by gateway/outputs/control (the local
// socket). All calls are thread-safe. Lines are numbered as in the configuration, devices as in the
// point store.
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

// What a line's status says of its port between the start and the first attempt to open it.

inline constexpr std::string_view kNotOpenedYet = "not opened yet";

class LineControl {
 public:
  virtual ~LineControl() = default;
  /// Closes the port for another program, and opens it again after `time`; a second call starts the
  /// time again. Meanwhile the line's points are out of service.
  virtual void Release(std::uint32_t line, Duration time) = 0;
  /// Lets network clients have the port, for `time`; a second call replaces the first. Points are
  /// out of service while a client has the port.
  virtual void Offer(std::uint32_t line, config::PortServer server, Duration time) = 0;
  /// Ends a release, and what Offer has begun, at once.
  virtual void TakeBack(std::uint32_t line) = 0;
  /// A device that is not in use is not polled, and its points are out of service. Not kept over a
  /// restart; the configuration has `enabled: false` for that.
  virtual void SetInUse(std::uint32_t device, bool in_use) = 0;
  /// Null: it is not installed.
  virtual const protocols::Protocol* FindProtocol(const std::string& /*name*/) const {
    return nullptr;
  }
  /// Records of the line from now on, until the queue is given back. `wake` is called from the
  /// line's thread when the empty queue gets its first record; it must not block.
  virtual std::shared_ptr<records::TraceQueue> Trace(std::uint32_t line,
                                                     std::function<void()> wake) = 0;
  /// What the flight recorder holds of the line, oldest first.
  virtual std::vector<records::TraceRecord> Recorded(std::uint32_t line) = 0;
};

}  // namespace baudgate::lines
