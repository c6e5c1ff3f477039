// Where the publisher's samples go, and where write requests come from: the seam between the
// gateway and the DDS library, which may be in this process or in another one.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/datagram_counters.h"
#include "gateway/outputs/dds/neighbours.h"
#include "gateway/outputs/dds/request_intake.h"
#include "gateway/outputs/dds/samples.h"

namespace baudgate::dds {

/// How many instances the writers have room for.
struct Room {
  std::uint32_t points = 0;
  std::uint32_t devices = 0;
  /// Devices that have events, and the gateway; 0: there is no such topic, and none of alarms.
  std::uint32_t events = 0;

  /// True if this room is enough for the points and devices of `other`. `events` is not compared:
  /// it only decides how many events of each device are kept.
  bool Holds(const Room& other) const { return other.points <= points && other.devices <= devices; }
};

/// What became of a sample.
enum class Sent : std::uint8_t {
  yes,
  refused,  ///< the library did not take it: try it again in a while
  later,    ///< there is no room or nobody now: nothing is lost when it is tried again in a moment
};

/// Used by one thread, save for subscribers(), datagrams(), neighbours() and session(), and for
/// replies, which have a thread of their own.
class SampleWriter {
 public:
  virtual ~SampleWriter() = default;

  virtual Sent Write(const PointSample& sample) = 0;
  virtual Sent Write(const DeviceSample& sample) = 0;
  virtual Sent Write(const GatewaySample& sample) = 0;
  /// Where the gateway has events.
  virtual Sent Write(const EventSample&) { return Sent::refused; }
  virtual Sent Write(const AlarmSample&) { return Sent::refused; }
  /// To a request that OnRequest was told of.
  virtual Sent Write(const ReplySample&) { return Sent::refused; }
  /// The last call. Waits at most `most` until all subscribers have acknowledged everything; false
  /// after that, and if the writer cannot tell. With a DDS process behind a link, that process
  /// first publishes all points as not connected, which takes longer than `most`, and true also
  /// means that a subscriber of events is there.
  virtual bool WaitAcknowledged(Duration most) = 0;
  /// Replaces the writers of samples by empty ones with this room. Removed points and devices are
  /// gone for subscribers then, and use no room. Write takes nothing until the new session()
  /// begins.
  virtual Sent Reopen([[maybe_unused]] const Room& room) { return Sent::yes; }
  virtual Subscribers subscribers() const = 0;
  /// What the library was given of what came to its ports.
  virtual DatagramCounters datagrams() const { return {}; }
  virtual Neighbours neighbours() const { return {}; }

  /// The number of the present receiver of samples; a new one knows nothing of what was sent
  /// before. 0: there is none.
  virtual std::uint64_t session() const { return 1; }
  /// Before the first sample: `changed` is called, from any thread, whenever session() changes, and
  /// when there is somebody who reads the events.
  virtual void OnSession([[maybe_unused]] const std::function<void()>& changed) {}

  using TakeRequest = std::function<void(WriteArrival arrival)>;
  /// `take` is called, from any thread, with each request to this gateway; null: no longer, and no
  /// call is under way when this returns. If writing is denied, they are not received.
  virtual void OnRequest([[maybe_unused]] TakeRequest take) {}
  /// Requests that came faster than they can be handed on.
  virtual std::uint64_t dropped_requests() const { return 0; }
};

}  // namespace baudgate::dds
