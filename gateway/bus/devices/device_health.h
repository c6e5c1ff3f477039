// Whether a device is there: decided from the outcomes of its exchanges by count *and* by time, so
// neither one lost reply nor a fast burst of retries makes a device offline. Time is an argument.
// HeardPoints keeps which points were answered, JumpCheck decides which readings count at once, and
// Identity keeps what the device answers to the request that identifies it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "config/model/point.h"
#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/points/device_status.h"
#include "gateway/bus/points/point_store.h"

namespace baudgate {

// Which points of a device were answered since it was connected. It decides one question: does
// silence to a request say something about the device, or about the points that were asked for?
// Many devices are silent to points that they do not have.
//
//   p was answered, q never; p is answered at 1 s
//   silence to p at 2 s     about the device
//   silence to q at 2 s     about q
//   silence to q at 12 s    about the device: it has not answered anything for 10 s
//   a late reply            for ten minutes silence may be lateness: about the device
//
class HeardPoints {
 public:
  /// It may be another device now.
  void Clear() {
    heard_.clear();
    last_.reset();
    late_.reset();
  }
  void OnLate(Instant now) { late_ = now; }
  void OnValue(std::size_t point, Instant now) {
    if (heard_.size() <= point) heard_.resize(point + 1);
    heard_[point] = true;
    last_ = now;
  }
  bool TellsOfDevice(const std::vector<std::size_t>& points, Instant now) const {
    if (!last_ || now - *last_ > kTrusted) return true;
    if (late_ && now - *late_ < kLate) return true;
    return std::ranges::any_of(
        points, [this](std::size_t point) { return point < heard_.size() && heard_[point]; });
  }

 private:
  static constexpr Duration kTrusted = 10s;
  static constexpr Duration kLate = 10min;

  std::vector<bool> heard_;
  std::optional<Instant> last_;
  std::optional<Instant> late_;
};

class DeviceHealth {
 public:
  /// Offline after this many failed tasks in a row (each with its retries) that span at least this
  /// time.
  static constexpr int kOfflineCount = 3;
  static constexpr Duration kOfflineTime = 1s;
  /// Degraded while at least this many of the last 32 exchanges failed.
  static constexpr int kDegradedCount = 3;

  /// Every exchange, retries included: decides about degraded.
  void OnExchange(Outcome outcome);
  /// The end of a task: decides about online and offline.
  void OnTask(Outcome outcome, Instant now);

  DeviceState state() const;
  /// Only probes are sent to it: it went offline, or it has not answered its first task. Its
  /// state() is never_seen in the second case.
  bool absent() const { return offline_ || (!seen_ && failed_tasks_ > 0); }
  /// Its last two exchanges were refused: it is there, but gives nothing.
  bool refuses() const { return refusals_ > 1; }
  /// Its last task failed.
  bool failing() const { return failed_tasks_ > 0; }

 private:
  std::uint32_t failures_ = 0;  // one bit per exchange, the latest lowest
  int refusals_ = 0;            // in a row
  int failed_tasks_ = 0;
  Instant failing_since_{};
  bool seen_ = false;
  bool offline_ = false;
};

// Which readings of one device count at once, and which only when a second one agrees: an 8-bit
// checksum, or none, lets some damage through. Per point, with jump 2:
//
//   last   readings         what users see
//   20.0   20.5             20.5
//   20.5   84.5, 20.6       20.5 uncertain, then 20.6: 84.5 was damage
//   20.6   84.5, 84.4       20.6 uncertain, then 84.4
//   84.4   12.0, 55.0, 71   84.4 uncertain twice, then 71.0 uncertain: there is no better one
//
// Without `jump` at the point it is a tenth of max - min if these are given, else the larger of
// a tenth of the last value and 1 % of the largest one seen. Bits and texts jump with every change.
// A first reading always jumps.
class JumpCheck {
 public:
  /// After this many readings in a row that disagree the last one counts.
  static constexpr int kMostReadings = 3;

  /// `points` outlive it.
  explicit JumpCheck(std::span<const config::Point> points) : points_(points) {}

  struct Result {
    std::vector<std::size_t> doubtful;    ///< their last values are uncertain until they are read
    bool ask_again = false;               ///< now
    bool unconfirmed = false;             ///< what jumped before was back at its last value
    std::optional<config::Group> spoils;  ///< a seldom group of which a point stays uncertain
  };
  /// Removes from the samples of one reply those that do not count yet. Samples that are not good
  /// always count.
  Result Check(std::vector<Sample>& samples);
  /// The device has confirmed a write: a reading that agrees counts.
  void OnWritten(std::size_t point, Value value);

 private:
  struct History {
    Value last;       // that counted
    Value candidate;  // read since, and not confirmed
    Decimal largest;
    int readings = 0;      // in a row that disagreed
    bool changes = false;  // the reply before was of something that changes
  };
  enum class Judgement { counts, wait, doubt, last_resort };

  Judgement Judge(const config::Point& point, History& history, const Value& value) const;
  static bool Agree(const config::Point& point, const History& history, const Value& a,
                    const Value& b);

  std::span<const config::Point> points_;
  std::vector<History> histories_;  // as points_; empty until one is needed
};

// What a device answers to the request that identifies it. Used by
// gateway/bus/replies/whose_reply.cpp.
class Identity {
 public:
  bool known() const { return !reply_.empty(); }
  /// The device reports its name, and does not only refuse to.
  bool names() const { return known() && names_; }
  /// Whether this is the request that identifies the device.
  bool IsAskedBy(const Bytes& request) const { return known() && request == request_; }
  /// Whether these bytes are what it answers to that.
  bool Is(View reply) const;

  /// The request was answered like this, and the reply can be to no other request.
  void Learn(const Bytes& request, View reply, Outcome outcome);
  /// The request was answered by a reply that Is knows.
  void OnSame() {
    other_.clear();
    certain_ = true;
  }
  /// It has come more than once.
  bool certain() const { return certain_; }
  /// The request was answered otherwise. True: as the last time. Once may be damage, where replies
  /// carry no check value.
  bool OnOther(View reply);

 private:
  Bytes request_;
  Bytes reply_;
  Bytes other_;  // came last in place of reply_
  bool names_ = false;
  bool certain_ = false;
};

}  // namespace baudgate
