// `SampleWriter` is the interface to the DDS library, which runs in this process or in
// baudgate-dds: the publisher passes samples to it and receives write requests from it. Pacer
// limits a rate, RequestIntake queues write requests, and PacedWriter writes so slowly that no
// sample is lost.
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

/// Pacer limits the rate of samples: `burst` samples at once, then one per `interval`. Without a
/// limit, a burst that overflows the socket buffers loses samples and costs seconds of
/// retransmission. The time is an argument.
class Pacer {
 public:
  Pacer(Duration interval, std::uint32_t burst)
      : interval_(interval), allowance_(interval * burst) {}

  /// True if one sample is allowed to be sent now. The sample is then counted as sent.
  bool Take(Instant now);
  /// Returns the time when half a burst is allowed to be sent, because a wake-up for every single
  /// sample would cost more than the sample.
  Instant ReadyAt() const { return reserved_until_ - allowance_ / 2; }

 private:
  Duration interval_;
  Duration allowance_;
  Instant reserved_until_{};
};

// WriteArrival is a write request on its way from the DDS library to
// gateway/outputs/dds/writes/write_service.h.
struct WriteArrival {
  RequestSample request;
  WriterId writer;
  Instant received{};  ///< time at which the process with the DDS library received the request
  /// The source timestamp by the client's clock; 1970: the request has no timestamp.
  WallTime published{};
  /// True if `published` is before this gateway began to read requests.
  bool early = false;
  /// True unless the client's writer is known to be volatile. A writer that stores samples can
  /// deliver an old request.
  bool lasting = false;
};

/// RequestIntake is a queue of requests with a bounded length and rate. Requests beyond the bounds
/// are counted and dropped; their clients must repeat them.
class RequestIntake {
 public:
  static constexpr std::size_t kMost = 128;
  /// The rate limit: kBurst requests at once, then one per kInterval.
  static constexpr Duration kInterval = 2ms;
  static constexpr std::uint32_t kBurst = 128;

  /// `wake` is called on the thread of Offer, after a request was queued.
  explicit RequestIntake(std::function<void()> wake) : wake_(std::move(wake)) {}

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

/// Room: the numbers of points and devices for which the DDS writers have space.
struct Room {
  std::uint32_t points = 0;
  std::uint32_t devices = 0;
  /// The number of devices that have events, plus 1 for the gateway; 0: the topics of events and
  /// alarms are not opened.
  std::uint32_t events = 0;

  /// True if this Room is enough for the points and devices of `other`. `events` is not compared,
  /// because it only decides how many events of each device are stored.
  bool Holds(const Room& other) const { return other.points <= points && other.devices <= devices; }
};

enum class Sent : std::uint8_t {
  yes,
  refused,  ///< the library did not accept the sample: write it again after about a second
  /// The DDS process is absent or its socket is full: write the sample again some milliseconds
  /// later.
  later,
};

/// One thread uses a SampleWriter, with two exceptions: any thread may call subscribers(),
/// datagrams(), neighbours() and session(), and a second thread is allowed to write replies.
class SampleWriter {
 public:
  virtual ~SampleWriter() = default;

  virtual Sent Write(const PointSample& sample) = 0;
  virtual Sent Write(const DeviceSample& sample) = 0;
  virtual Sent Write(const GatewaySample& sample) = 0;
  /// Events and alarms are accepted only if Room::events is not 0.
  virtual Sent Write(const EventSample&) { return Sent::refused; }
  virtual Sent Write(const AlarmSample&) { return Sent::refused; }
  /// Writes the reply to a request that OnRequest has passed on.
  virtual Sent Write(const ReplySample&) { return Sent::refused; }
  /// Waits at most `most` until all subscribers have acknowledged all samples; no other call may
  /// follow. False: they have not, or the writer cannot find out. If the writer is in baudgate-dds,
  /// that process first publishes all points as not connected, which can take longer than `most`;
  /// the result is then true only if a subscriber of events is connected.
  virtual bool WaitAcknowledged(Duration most) = 0;
  /// Replaces the writers of samples by empty writers with this Room, so that subscribers no longer
  /// see removed points and devices. Until session() changes, Write accepts no sample.
  virtual Sent Reopen([[maybe_unused]] const Room& room) { return Sent::yes; }
  virtual Subscribers subscribers() const = 0;
  virtual DatagramCounters datagrams() const { return {}; }
  virtual Neighbours neighbours() const { return {}; }

  /// Returns the number of the present session; 0: there are no DDS writers, e.g. because
  /// baudgate-dds does not run. A new session begins with new DDS writers, which contain none of
  /// the earlier samples.
  virtual std::uint64_t session() const { return 1; }
  /// Sets the function that is called whenever session() changes, and when the first reader of
  /// events appears. `changed` may be called on any thread. To be set before the first sample.
  virtual void OnSession([[maybe_unused]] const std::function<void()>& changed) {}

  using TakeRequest = std::function<void(WriteArrival arrival)>;
  /// Sets the function that takes each write request to this gateway; any thread may call it. Null
  /// removes the function: no call is in progress when OnRequest returns. If the configuration
  /// denies writing, no requests are received.
  virtual void OnRequest([[maybe_unused]] TakeRequest take) {}
  virtual std::uint64_t dropped_requests() const { return 0; }
};

// PacedWriter writes samples at a rate at which no sample is lost, pauses while SampleWriter
// returns `later`, and counts the accepted and refused samples. The time is an argument.
class PacedWriter {
 public:
  /// Called with a log line when samples begin to be refused, and when they are accepted again.
  using Log = std::function<void(log::Level level, const std::string& line)>;

  static constexpr Duration kLongestHold = 10ms;

  /// `writer` must outlive this object.
  PacedWriter(SampleWriter& writer, Log log);

  bool MayWrite(Instant now) { return now >= held_until_ && pacer_.Take(now); }
  /// Writes a sample; only allowed after MayWrite returned true. If the result is `later`, the
  /// caller must write the sample again; MayWrite returns false until a pause of 1, 2, 4, 8, 10, 10
  /// … ms is over.
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
  void ForgetHold() { held_until_ = {}; }

  std::uint64_t written() const { return written_; }
  std::uint64_t failed() const { return failed_; }

 private:
  void Note(Sent sent, std::string_view whose, const std::string& name, Instant now);

  SampleWriter& writer_;
  const Log log_;
  Pacer pacer_;
  Instant held_until_{};
  Duration hold_{};  ///< the present pause; it doubles while SampleWriter returns `later`
  /// Refused samples since the last accepted one; the first of them is logged.
  std::uint64_t failing_ = 0;
  std::atomic<std::uint64_t> written_ = 0;
  std::atomic<std::uint64_t> failed_ = 0;
};

}  // namespace baudgate::dds
