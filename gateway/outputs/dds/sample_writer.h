// Where the publisher's samples go, and where write requests come from: the seam between the
// gateway and the DDS library, which may be in this process or in another one. Pacer sets the pace,
// RequestIntake holds write requests, and PacedWriter writes at a pace that loses no sample.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/guarded.h"
#include "gateway/base/log.h"
#include "gateway/base/time.h"
#include "gateway/outputs/dds/domain.h"
#include "gateway/outputs/dds/samples.h"

namespace baudgate::dds {

// How fast something may go on. Time is an argument.

/// Keeps bursts below what socket buffers hold (a burst that overflows them is lost and costs
/// seconds of retransmission): `burst` samples at once, then one every `interval`.
class Pacer {
 public:
  Pacer(Duration interval, std::uint32_t burst)
      : interval_(interval), allowance_(interval * burst) {}

  /// One sample may go now.
  bool Take(Instant now);
  /// When half a burst may go: waking for each single sample would cost more than sending it.
  Instant ReadyAt() const { return reserved_until_ - allowance_ / 2; }

 private:
  Duration interval_;
  Duration allowance_;
  Instant reserved_until_{};
};

// Write requests on their way to the part that carries them out. Their rate and the number that
// waits are bounded; requests beyond are counted and dropped, and their client asks again. From the
// DDS library's threads to gateway/outputs/dds/link/link_server.h, and from there to
// gateway/outputs/dds/writes/write_service.h.
struct WriteArrival {
  RequestSample request;
  WriterId writer;
  Instant received{};  ///< by the process that speaks DDS
  /// By the clock of its client, as its time stamp says; 1970: it carries none.
  WallTime published{};
  /// It was published before there was a reader of requests to this gateway.
  bool early = false;
  /// Its writer is not known to keep nothing: it may be older than this reader.
  bool lasting = false;
};

class RequestIntake {
 public:
  static constexpr std::size_t kMost = 128;     ///< that wait
  static constexpr Duration kInterval = 2ms;    ///< one each, after a burst
  static constexpr std::uint32_t kBurst = 128;  ///< requests at once

  /// `wake`: on the thread of Offer, after something has come.
  explicit RequestIntake(std::function<void()> wake) : wake_(std::move(wake)) {}

  /// From any thread.
  void Offer(WriteArrival arrival, Instant now);
  std::optional<WriteArrival> Take();
  /// That found no room, so far.
  std::uint64_t dropped() const;

 private:
  bool Keep(WriteArrival& arrival, Instant now);

  const std::function<void()> wake_;
  mutable Mutex mutex_;
  Pacer pace_ BAUDGATE_GUARDED_BY(mutex_){kInterval, kBurst};
  std::deque<WriteArrival> waiting_ BAUDGATE_GUARDED_BY(mutex_);
  std::uint64_t dropped_ BAUDGATE_GUARDED_BY(mutex_) = 0;
};

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

// Writes samples at a pace that loses none on the way, rests when the receiver has no room, and
// counts what was taken and refused. Time is an argument.
class PacedWriter {
 public:
  /// One line for people, at a change only, without the name of the output.
  using Log = std::function<void(log::Level level, const std::string& line)>;

  static constexpr Duration kLongestHold = 10ms;

  /// `writer` outlives this.
  PacedWriter(SampleWriter& writer, Log log);

  /// The next sample may be written now.
  bool MayWrite(Instant now) { return now >= held_until_ && pacer_.Take(now); }
  /// After MayWrite. `later`: write the sample again after a pause of 1, 2, 4, 8, 10, 10 … ms.
  template <typename Sample>
  Sent Write(const Sample& sample, Instant now) {
    const Sent sent = writer_.Write(sample);
    if constexpr (requires { sample.device; }) {
      Note(sent, "device ", sample.device, now);
    } else {
      Note(sent, "gateway ", sample.gateway, now);
    }
    return sent;
  }

  bool EventsAreRead() const { return writer_.subscribers().events > 0; }
  Instant ReadyAt() const { return std::max(held_until_, pacer_.ReadyAt()); }
  /// There is a new receiver.
  void ForgetHold() { held_until_ = {}; }

  // From any thread.
  std::uint64_t written() const { return written_; }
  std::uint64_t failed() const { return failed_; }

 private:
  void Note(Sent sent, std::string_view whose, const std::string& name, Instant now);

  SampleWriter& writer_;
  const Log log_;
  Pacer pacer_;
  Instant held_until_{};
  Duration hold_{};            ///< doubles while there is no room
  std::uint64_t failing_ = 0;  ///< failures since the last success; the edge is logged
  std::atomic<std::uint64_t> written_ = 0;
  std::atomic<std::uint64_t> failed_ = 0;
};

}  // namespace baudgate::dds
