// Sends what goes before values: the start of the gateway, the ends of points, events and alarms.
// A sample that is refused is tried again a second later. Sans-I/O: time is an argument;
// gateway/outputs/dds/publisher.h says when. EventSupply gives the events, and EventSender and
// AlarmSender choose which is published next.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/point_samples.h"
#include "gateway/outputs/dds/sample_writer.h"
#include "gateway/outputs/dds/samples.h"

namespace baudgate::dds {

// The events and alarms that are on the disk, as samples: what EventSender takes from.
// gateway/daemon joins it with gateway/records/events/event_feed.h.

/// From any thread; nothing waits for the disk.
class EventSupply {
 public:
  virtual ~EventSupply() = default;
  /// Those after the number `after`, in their order, at most `most`. None also where
  /// they have to be fetched first; OnNew is told then. One without `gateway` is not
  /// published: its device is no longer configured.
  virtual std::vector<EventSample> Take(std::uint64_t after, std::size_t most) = 0;
  virtual std::uint64_t newest() const = 0;  ///< 0: none, or not known yet

  struct Place {
    std::uint64_t seq = 0;
    bool sure = false;  ///< subscribers have confirmed all up to there
  };
  /// The place last given to Keep, kept over a restart; empty: none was. Known with newest().
  virtual std::optional<Place> place() const { return std::nullopt; }
  virtual void Keep(Place /*place*/) {}
  struct Alarm {
    std::uint64_t version = 0;  ///< counts the changes of all alarms, since the start
    AlarmSample sample{};
  };
  /// Those that have changed after this version, as they are now, by their versions; 0: all.
  virtual std::vector<Alarm> TakeAlarms(std::uint64_t /*after*/, std::size_t /*most*/) {
    return {};
  }

  /// `wake`, on any thread, when there are more; null: no longer, and no call is under way when
  /// this returns.
  virtual void OnNew(std::function<void()> wake) = 0;
};

// Which event is published next: each once, in the order of the numbers; to a new reader the newest
// ones once more. After a restart it goes on where it was, if subscribers have confirmed that.
// Pure; NoticeSender sends.
//
//   there are 1 … 5000, and a reader comes    → 4001, 4002 … 5000
//   5001 happens                              → 5001
//   it leaves after 5001, another comes       → 4002 … 5001
//   5002 … 7500 happen before another comes   → 4002 … 7500: also those that no reader has had
//   an orderly end, a start, and 7501         → 7501
//   a kill and a start                        → 6502 … 7501: some may have been lost on their way
//
// What has left the supply before it was taken is skipped, and counted.

class EventSender {
 public:
  /// Null: there are no events. It outlives this.
  explicit EventSender(EventSupply* supply) : supply_(supply) {}

  void StartAnew();
  /// The one to be sent; null: none now. The same until OnSent.
  const EventSample* Next();
  void OnSent();
  /// Subscribers have all that was sent.
  void Confirm();

  /// From any thread.
  std::uint64_t sent() const { return sent_; }
  std::uint64_t skipped() const { return skipped_; }

 private:
  bool FindPlace();
  void GoTo(std::uint64_t seq);
  bool Load();

  EventSupply* const supply_;
  bool placed_ = false;        ///< for whoever takes samples now
  bool ever_ = false;          ///< for anybody
  std::uint64_t place_ = 0;    ///< number of the last that was sent
  std::uint64_t reached_ = 0;  ///< the highest of these; what is sent before it comes once more
  std::vector<EventSample> batch_;
  std::size_t next_ = 0;  ///< of batch_
  std::atomic<std::uint64_t> sent_ = 0;
  std::atomic<std::uint64_t> skipped_ = 0;
};

// Which alarm is published next: each one that has changed, as it is now; all of them to a new
// reader. Pure; NoticeSender sends.
class AlarmSender {
 public:
  /// Null: there are none. It outlives this.
  explicit AlarmSender(EventSupply* supply) : supply_(supply) {}

  void StartAnew();
  /// The one to be sent; null: none now. The same until OnSent.
  const AlarmSample* Next();
  void OnSent();

 private:
  EventSupply* const supply_;
  std::uint64_t version_ = 0;  ///< of the last that was sent
  std::vector<EventSupply::Alarm> batch_;
  std::size_t next_ = 0;  ///< of batch_
};

class NoticeSender {
 public:
  /// Subscribers that are already there find a new gateway within this time.
  static constexpr Duration kDiscoveryTime = 500ms;
  /// All subscribers that are running have found a new gateway within this time. Events wait so
  /// long until somebody reads them. If 3,000 events wait and the writer keeps 1,000, sending them
  /// at once would lose the oldest 2,000 before the first reader is found.
  static constexpr Duration kMeetingTime = 15s;

  /// All outlive this. `now` is told as the gateway's start. `events`: null: there
  /// are none.
  NoticeSender(const config::Config& config, const bus::PointStore& store, PacedWriter& paced,
               EventSupply* events, Now now);

  /// `same`: the receiver is the same, and only its writers of samples are others.
  void StartAnew(Instant now, bool same = false);
  PointEnds& ends() { return ends_; }
  DeviceEnds& device_ends() { return device_ends_; }
  bool EndsAreTold() const { return ends_.empty() && device_ends_.empty(); }
  /// Also those that were refused.
  void SendEndsAt(Instant at) { ends_due_ = at; }

  /// At most 64 of each kind. False: the pace or the writer does not allow it now.
  bool Send(Instant now);
  /// When what is left may be sent.
  Instant Due();

  /// Sends the events and alarms until now, as far as the pace allows, for at most 700 ms. Returns
  /// when to go on; empty: all are sent, or cannot be.
  std::optional<Instant> End(Instant now);
  /// Behind End: subscribers have confirmed everything.
  void Confirm() { events_.Confirm(); }

  /// From any thread.
  const EventSender& events() const { return events_; }

 private:
  bool SendGateway(Instant now);
  Instant EventsDue() const;
  template <typename Sender>
  bool SendFrom(Sender& sender, Instant& due, Instant now);
  template <typename Sender>
  std::optional<Instant> EndOf(Sender& sender, Instant now);

  PacedWriter& paced_;
  GatewaySample gateway_;
  Instant gateway_due_;  ///< Instant::max(): it has been sent
  PointEnds ends_;
  DeviceEnds device_ends_;
  Instant ends_due_{};  ///< not before
  EventSender events_;
  Instant events_due_;  ///< not before
  Instant meets_until_;
  AlarmSender alarms_;
  Instant alarms_due_;             ///< not before
  std::optional<Instant> end_by_;  ///< the end is being told
};

}  // namespace baudgate::dds
