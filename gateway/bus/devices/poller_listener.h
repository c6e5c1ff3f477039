// Interfaces that a poller needs: `RequestPort` sends its requests (gateway/lines/line_port.h),
// `PollerListener` gets news of devices (gateway/lines/line_reporter.h), and `EventSink` saves
// events.
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
  protocols::EventBatch batch{};     ///< contains at least one event or record of the past
  Now received{};                    ///< the end of the reply
  std::optional<Duration> oldest{};  ///< greatest age of the events at `received`; empty: unknown
};

/// A fact that the gateway itself has found, to be saved as an event.
struct News {
  enum class What : std::uint8_t {
    no_answer,  ///< a device is offline
    not_in_use,
    wrong_device,  ///< another device than the configured one answers: its readings do not count
    replaced,      ///< another device answers in place of a device; this news has no end
    port_down,     ///< concerns the line, as all below
    port_lent,
    collisions,  ///< another master is on the line
    ring_open,
    port_served,  ///< a network client uses the port
  };
  What what = What::no_answer;
  bool over = false;                      ///< the fact was reported before, and has ended
  std::optional<std::uint32_t> device{};  ///< index in the point store
  std::string text{};
  /// Only with `over`: this line has not reported the beginning, perhaps because it was before the
  /// start of the program.
  bool first = false;
};

/// The reason for the client if a request was never sent.
inline constexpr const char* kNotConnected = "the connection was not made in time";

class RequestPort {
 public:
  virtual ~RequestPort() = default;
  /// Sends a whole request at once, with these settings of the port.
  virtual void Send(View bytes, const config::SerialSettings& serial, Now now) = 0;
  /// Called when no good reply came. Bytes of the request that have not left this machine must not
  /// leave it later.
  virtual void DropUnsent() {}
  /// True if nothing of the latest request has left this machine: it waits for a connection, or no
  /// connection was made in time.
  virtual bool IsUnsent() const { return false; }
};

class PollerListener {
 public:
  virtual ~PollerListener() = default;
  /// Called once per change. `device` is numbered as for Tap (gateway/bus/exchange/line.h).
  virtual void OnDeviceState(std::uint32_t device, DeviceState from, DeviceState to,
                             const std::string& reason, Now at) = 0;
  /// The memory of the conversation (protocols::Conversation::Memory) has changed and is to be
  /// saved.
  virtual void OnMemory(std::uint32_t /*device*/, const std::string& /*memory*/) {}
  /// The device is not asked for further events before Poller::OnEventsKept, which must not be
  /// called from here.
  virtual void OnEvents(ReportedEvents /*events*/) {}
  /// The device was asked at `asked` or later and had no further events: it has reported all that
  /// happened before.
  virtual void OnDrained(std::uint32_t /*device*/, Instant /*asked*/) {}
  virtual void OnNews(News /*news*/, Now /*at*/) {}
  /// These points of the device have been read; their values are in the point store.
  virtual void OnRead(std::uint32_t /*device*/, std::span<const std::uint32_t> /*points*/,
                      Now /*at*/) {}
  /// A warning for the user that is no change of state: a suspected echo, a device that answers
  /// late.
  virtual void OnWarning(std::uint32_t device, const std::string& message) = 0;
};

/// Takes events of lines and saves them. Implemented by gateway/records/event_path.h. Called on the
/// threads of the lines; returns at once.
class EventSink {
 public:
  virtual ~EventSink() = default;
  /// See PollerListener::OnEvents.
  virtual void OnReported(ReportedEvents events) = 0;
  /// See PollerListener::OnDrained.
  virtual void OnDrained(std::uint32_t device, Instant asked) = 0;
  virtual void OnNews(const config::Line& line, const News& news, Now at) = 0;
  /// See PollerListener::OnRead.
  virtual void OnRead(std::uint32_t device, std::span<const std::uint32_t> points, Now at) = 0;
};

}  // namespace baudgate::bus
