// `SampleWriter` is the interface to the DDS library, in this process or in baudgate-dds: the
// publisher hands over samples and receives write requests. Pacer limits a rate, RequestIntake
// queues write requests, and PacedWriter writes so slowly that no sample is lost.
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

/// Limits the rate of samples to `burst` at once, then one per `interval`, because a burst that
/// overflows the socket buffers loses samples and costs seconds of retransmission. The time is an
/// argument.
class Pacer {
 public:
  Pacer(Duration interval, std::uint32_t burst)
      : interval_(interval), allowance_(interval * burst) {}

  /// True if one sample may be sent now, which is then counted.
  bool Take(Instant now);
  /// Returns when half a burst may be sent: a wake-up for each single sample would cost more than
  /// the sample.
  Instant ReadyAt() const { return reserved_until_ - allowance_ / 2; }

 private:
  Duration interval_;
  Duration allowance_;
  Instant reserved_until_{};
};

// A write request on its way from the DDS library to gateway/outputs/dds/writes/write_service.h.
struct WriteArrival {
  RequestSample request;
  WriterId writer;
  Instant received{};  ///< by the process with the DDS library
  /// The source timestamp by the client's clock; 1970: none.
  WallTime published{};
  /// True if `published` is before this gateway began to read requests.
  bool early = false;
  /// True if the writer may be durable, so the request may be an old one.
  bool lasting = false;
};

/// A queue with a bounded length and rate. Requests beyond the bounds are counted and dropped;
/// their client repeats them.
class RequestIntake {
 public:
  static constexpr std::size_t kMost = 128;     ///< length of the queue
  static constexpr Duration kInterval = 2ms;    ///< one request per interval, after a burst
  static constexpr std::uint32_t kBurst = 128;  ///< requests at once

  /// `wake` is called on the thread of Offer, after a request was queued.
  explicit RequestIntake(std::function<void()> wake) : wake_(std::move(wake)) {}

  /// Any thread may call it.
  void Offer(WriteArrival arrival, Instant now);
  std::optional<WriteArrival> Take();
  std::uint64_t dropped() const;

 private:
  bool Keep(WriteArrival& arrival, Instant now);

  const std::function<void()> wake_;
  mutable Mutex mutex_;
  Pacer pace_ BAUDGATE_GUARDED_BY(mutex_){kInterval, kBurst};
  std::deque<WriteArrival> waiting_ BAUDGATE_GUARDED_BY(mutex_);
  std::uint64_t dropped_ BAUDGATE_GUARDED_BY(mutex_) = 0;
};

/// The number of instances for which there are writers.
struct Room {
  std::uint32_t points = 0;
  std::uint32_t devices = 0;
  /// The number of devices that have events, plus 1 for the gateway; 0: there are no topics of
  /// events and alarms.
  std::uint32_t events = 0;

  /// True if this room is enough for the points and devices of `other`. `events` is not compared,
  /// because it only decides how many events of each device are stored.
  bool Holds(const Room& other) const { return other.points <= points && other.devices <= devices; }
};

enum class Sent : std::uint8_t {
  yes,
  refused,  ///< the library did not accept the sample: write it again after about a second
  later,    ///< the receiver has no room or is absent: write it again after some milliseconds
};

/// One thread may use it, except: any thread may call subscribers(), datagrams(), neighbours() and
/// session(), and a second thread may write replies.
class SampleWriter {
 public:
  virtual ~SampleWriter() = default;

  virtual Sent Write(const PointSample& sample) = 0;
  virtual Sent Write(const DeviceSample& sample) = 0;
  virtual Sent Write(const GatewaySample& sample) = 0;
  /// Only if Room::events is not 0.
  virtual Sent Write(const EventSample&) { return Sent::refused; }
  virtual Sent Write(const AlarmSample&) { return Sent::refused; }
  /// Replies to a request of OnRequest.
  virtual Sent Write(const ReplySample&) { return Sent::refused; }
  /// Waits at most `most` until all subscribers have acknowledged all samples; no other call may
  /// follow. False after that time, or if the writer cannot find out. With baudgate-dds behind a
  /// link, that process first publishes all points as not connected, which may take longer than
  /// `most`; there true also means that a subscriber of events is connected.
  virtual bool WaitAcknowledged(Duration most) = 0;
  /// Replaces the writers of samples by empty ones with this room, so that removed points and
  /// devices are gone for subscribers. Until the new session() begins, Write accepts no sample.
  virtual Sent Reopen([[maybe_unused]] const Room& room) { return Sent::yes; }
  virtual Subscribers subscribers() const = 0;
  virtual DatagramCounters datagrams() const { return {}; }
  virtual Neighbours neighbours() const { return {}; }

  /// Returns the number of the present session; 0: there is no receiver of samples. A new session
  /// begins with a receiver that has none of the samples sent before.
  virtual std::uint64_t session() const { return 1; }
  /// Sets the function that is called whenever session() changes, and when the first reader of
  /// events appears. `changed` may be called on any thread. To be set before the first sample.
  virtual void OnSession([[maybe_unused]] const std::function<void()>& changed) {}

  using TakeRequest = std::function<void(WriteArrival arrival)>;
  /// Sets the function that takes each write request to this gateway; it may be called on any
  /// thread. Null ends this, and no call is in progress when OnRequest returns. If the
  /// configuration denies writing, no requests are received.
  virtual void OnRequest([[maybe_unused]] TakeRequest take) {}
  virtual std::uint64_t dropped_requests() const { return 0; }
};

// Writes samples at a rate at which none is lost, pauses when the receiver has no room, and counts
// the accepted and refused samples. The time is an argument.
class PacedWriter {
 public:
  /// Called with a log line when samples begin to be refused, and when they are accepted again.
  using Log = std::function<void(log::Level level, const std::string& line)>;

  static constexpr Duration kLongestHold = 10ms;

  /// `writer` must outlive this object.
  PacedWriter(SampleWriter& writer, Log log);

  /// True if the next sample may be written now.
  bool MayWrite(Instant now) { return now >= held_until_ && pacer_.Take(now); }
  /// Writes a sample; only after MayWrite was true. After `later` the caller writes the sample
  /// again; MayWrite is false until a pause of 1, 2, 4, 8, 10, 10 … ms is over.
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
  /// Ends the pause, because there is a new receiver.
  void ForgetHold() { held_until_ = {}; }

  // Any thread may call these.
  std::uint64_t written() const { return written_; }
  std::uint64_t failed() const { return failed_; }

 private:
  void Note(Sent sent, std::string_view whose, const std::string& name, Instant now);

  SampleWriter& writer_;
  const Log log_;
  Pacer pacer_;
  Instant held_until_{};
  Duration hold_{};            ///< the present pause; doubles while there is no room
  std::uint64_t failing_ = 0;  ///< failures since the last success; the first of them is logged
  std::atomic<std::uint64_t> written_ = 0;
  std::atomic<std::uint64_t> failed_ = 0;
};

}  // namespace baudgate::dds
