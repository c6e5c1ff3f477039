// The interfaces that the poller of a line calls: `RequestPort` sends requests to the serial port
// (implemented in gateway/lines/line_port.h), `PollerListener` gets news of devices
// (gateway/lines/line_reporter.h), and `EventSink` saves events.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/model/serial.h"
#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/points/device_status.h"
#include "protocols/conversation.h"

namespace baudgate::bus {

struct ReportedEvents {
  std::uint32_t device = 0;          ///< index in the point store
  protocols::EventBatch batch{};     ///< contains at least one event, or one record of a past value
  Now received{};                    ///< when the reply that contained the events ended
  std::optional<Duration> oldest{};  ///< greatest age of the events at `received`; empty: unknown
};

/// A fact that the gateway itself has found. It is saved as an event.
struct News {
  enum class What : std::uint8_t {
    no_answer,  ///< a device is offline
    not_in_use,
    wrong_device,  ///< another device than the configured one answers: its readings do not count
    replaced,      ///< the device reports another name than before; no news with `over` follows
    /// This value and the values below concern the line, not a device.
    port_down,
    port_lent,
    collisions,  ///< another master is on the line
    ring_open,
    port_served,  ///< a network client uses the port
  };
  What what = What::no_answer;
  bool over = false;                      ///< the fact was reported before, and has now ended
  std::optional<std::uint32_t> device{};  ///< index in the point store
  std::string text{};
  /// Set only with `over`: the line has not reported the beginning of the fact, for example because
  /// it was before the start of the program.
  bool first = false;
};

/// The reason for the client if a request was never sent.
inline constexpr const char* kNotConnected =
    "the request was not sent, because the server was not connected in time";

class RequestPort {
 public:
  virtual ~RequestPort() = default;
  /// Sends a whole request at once, after setting the port to `serial`.
  virtual void Send(View bytes, const config::SerialSettings& serial, Now now) = 0;
  /// Called when no good reply came. Discards bytes of the request that are still in buffers of
  /// this machine, so that they are not sent later.
  virtual void DropUnsent() {}
  /// True if no byte of the latest request has left this machine: the request waits for a
  /// connection, or no connection was made in time.
  virtual bool IsUnsent() const { return false; }
};

class PollerListener {
 public:
  virtual ~PollerListener() = default;
  /// Called once per change of state. `device` is numbered as in Tap (gateway/bus/exchange/line.h).
  virtual void OnDeviceState(std::uint32_t device, DeviceState from, DeviceState to,
                             const std::string& reason, Now at) = 0;
  /// The memory of the conversation with the device (text to be saved over a restart) has changed.
  virtual void OnMemory(std::uint32_t /*device*/, const std::string& /*memory*/) {}
  /// The device has reported events. It is not asked for more until the events are saved and
  /// Poller::OnEventsKept is called, which must not happen from within OnEvents.
  virtual void OnEvents(ReportedEvents /*events*/) {}
  /// The device was asked for events at `asked` or later and had no more: it has reported all
  /// events from before `asked`.
  virtual void OnDrained(std::uint32_t /*device*/, Instant /*asked*/) {}
  virtual void OnNews(News /*news*/, Now /*at*/) {}
  /// These points of the device were read. Their values are in the point store.
  virtual void OnRead(std::uint32_t /*device*/, std::span<const std::uint32_t> /*points*/,
                      Now /*at*/) {}
  /// Warns the user of something that changes no state. Examples: a suspected echo, a device that
  /// answers late.
  virtual void OnWarning(std::uint32_t device, const std::string& message) = 0;
};

/// Takes events of lines and saves them. Implemented in gateway/records/event_path.h. Each line
/// calls it on its own thread, and it returns without waiting.
class EventSink {
 public:
  virtual ~EventSink() = default;
  virtual void OnReported(ReportedEvents events) = 0;
  /// The device has no unsaved events from before `asked`: see PollerListener::OnDrained.
  virtual void OnDrained(std::uint32_t device, Instant asked) = 0;
  virtual void OnNews(const config::Line& line, const News& news, Now at) = 0;
  virtual void OnRead(std::uint32_t device, std::span<const std::uint32_t> points, Now at) = 0;
};

}  // namespace baudgate::bus
