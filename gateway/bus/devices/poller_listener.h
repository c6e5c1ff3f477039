// What a poller needs: a port for its requests, and a listener for the news of devices. Implemented
// by gateway/lines/line_port.h and gateway/lines/line_reporter.h. EventSink takes events to be
// saved.
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

/// Events that a device has reported, to be saved.
struct ReportedEvents {
  std::uint32_t device = 0;          ///< index in the point store
  protocols::EventBatch batch{};     ///< with at least one event, or record of the past
  Now received{};                    ///< the end of the reply
  std::optional<Duration> oldest{};  ///< the greatest age at `received`; empty: not known
};

/// What the gateway itself has found, to be saved as an event.
struct News {
  enum class What : std::uint8_t {
    no_answer,     ///< of a device: it is offline
    not_in_use,    ///< of a device
    wrong_device,  ///< of a device: its readings do not count
    replaced,      ///< of a device: another one answers in its place; without an end
    port_down,     ///< of the line, as all below
    port_lent,
    collisions,  ///< another master is on the line
    ring_open,
    port_served,  ///< a client has it
  };
  What what = What::no_answer;
  bool over = false;                      ///< it was reported before, and has ended
  std::optional<std::uint32_t> device{};  ///< index in the point store
  std::string text{};
  /// Only with `over`: this line has not told of the beginning, which may have been before the
  /// start.
  bool first = false;
};

/// Why a request that is unsent has got no answer.
inline constexpr const char* kNotConnected = "the connection was not made in time";

class RequestPort {
 public:
  virtual ~RequestPort() = default;
  /// A whole request, to be sent at once with these settings of the port.
  virtual void Send(View bytes, const config::SerialSettings& serial, Now now) = 0;
  /// No good reply came: bytes of the request that have not left this machine must not leave it
  /// later.
  virtual void DropUnsent() {}
  /// Nothing of the latest request has left this machine: it waits for a connection, or has waited
  /// for one in vain.
  virtual bool IsUnsent() const { return false; }
};

class PollerListener {
 public:
  virtual ~PollerListener() = default;
  /// One line per change, with the reason; `device` is numbered as for gateway/bus/exchange/line.h.
  virtual void OnDeviceState(std::uint32_t device, DeviceState from, DeviceState to,
                             const std::string& reason, Now at) = 0;
  /// The memory of the device's conversation, which is kept over a restart, has changed.
  virtual void OnMemory(std::uint32_t /*device*/, const std::string& /*memory*/) {}
  /// The device is not asked for more before Poller::OnEventsKept, which is not called from here.
  virtual void OnEvents(ReportedEvents /*events*/) {}
  /// The device was asked at `asked` or later and had no events: all that it reported is saved.
  virtual void OnDrained(std::uint32_t /*device*/, Instant /*asked*/) {}
  /// A fact that has no call of its own above.
  virtual void OnNews(News /*news*/, Now /*at*/) {}
  /// These points of the device have been read; the point store has their values.
  virtual void OnRead(std::uint32_t /*device*/, std::span<const std::uint32_t> /*points*/,
                      Now /*at*/) {}
  /// Something the user should know that is not a state: an echo suspected, a late device.
  virtual void OnWarning(std::uint32_t device, const std::string& message) = 0;
};

/// Takes over the events of lines and saves them: implemented by gateway/records/event_path.h.
/// Called on the threads of the lines; returns at once.
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

}  // namespace baudgate::bus
