// `NoticeSender` sends the samples that precede values: the start of the gateway, the final samples
// of removed points and devices, events and alarms. A refused sample is sent again after a second.
// No I/O and no clock: gateway/outputs/dds/publisher.h calls it with the time. EventSupply supplies
// the events and alarms; EventSender and AlarmSender choose the next one.
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

/// EventSupply supplies stored events and alarms as samples (gateway/records/events/event_feed.h).
/// Any thread may call it; no call waits for the disk.
class EventSupply {
 public:
  virtual ~EventSupply() = default;
  /// Returns at most `most` events with numbers above `after`, in ascending order. If they must be
  /// read from the file first, it returns none and calls the function of OnNew later. An event with
  /// an empty `gateway` is not published, because its device is no longer configured.
  virtual std::vector<EventSample> Take(std::uint64_t after, std::size_t most) = 0;
  /// Returns the number of the newest event; 0: there are no events, or their file has not been
  /// read yet.
  virtual std::uint64_t newest() const = 0;

  struct Place {
    std::uint64_t seq = 0;
    bool sure = false;  ///< true: subscribers have acknowledged all events up to `seq`
  };
  /// Returns the argument of the last call of Keep, also after a restart; nothing: Keep was never
  /// called. The result is valid when newest() is not 0.
  virtual std::optional<Place> place() const { return std::nullopt; }
  virtual void Keep(Place /*place*/) {}
  struct Alarm {
    /// Number of the change. The changes of all alarms since the gateway's start are counted
    /// together.
    std::uint64_t version = 0;
    AlarmSample sample{};
  };
  /// Returns at most `most` alarms that have changed since version `after` (0: all alarms), in
  /// their present state, sorted by version.
  virtual std::vector<Alarm> TakeAlarms(std::uint64_t /*after*/, std::size_t /*most*/) {
    return {};
  }

  /// Sets the function to call when there are new events or alarms; any thread may call it. Null
  /// removes the function: no call is in progress when OnNew returns.
  virtual void OnNew(std::function<void()> wake) = 0;
};

// EventSender chooses the next event to publish. Each event is sent once, in the order of the
// numbers; a new session (SampleWriter::session) gets the newest 1000 again. After a restart,
// sending continues after the last event if subscribers had acknowledged everything.
//
//   events 1 … 5000 exist, a session begins        → 4001, 4002 … 5000
//   event 5001 is added                            → 5001
//   the session ends, the next one begins          → 4002 … 5001
//   5002 … 7500 are added, then a session begins   → 4002 … 7500: no session has had the last 2499
//   an orderly stop, a start, 7501 is added        → 7501
//   a kill and a start                             → 6502 … 7501: some may have been lost
//
// Events that the supply deletes before they were taken are counted as skipped.

class EventSender {
 public:
  /// `supply` must outlive this object. Null: there are no events.
  explicit EventSender(EventSupply* supply) : supply_(supply) {}

  void StartAnew();
  /// Returns the event to send next; null: there is no event to send now. Returns the same event
  /// until OnSent.
  const EventSample* Next();
  void OnSent();
  /// Stores that subscribers have acknowledged all events that were sent.
  void Confirm();

  std::uint64_t sent() const { return sent_; }
  std::uint64_t skipped() const { return skipped_; }

 private:
  bool FindPlace();
  void GoTo(std::uint64_t seq);
  bool Load();

  EventSupply* const supply_;
  bool placed_ = false;
  bool ever_ = false;          ///< place_ was determined at least once since the start
  std::uint64_t place_ = 0;    ///< number of the last event that was sent
  std::uint64_t reached_ = 0;  ///< the highest place_ so far; events up to it are repetitions
  std::vector<EventSample> batch_;
  std::size_t next_ = 0;
  std::atomic<std::uint64_t> sent_ = 0;
  std::atomic<std::uint64_t> skipped_ = 0;
};

// AlarmSender chooses the next alarm to publish: each alarm that has changed, in its present state.
// A new session (SampleWriter::session) gets all alarms.
class AlarmSender {
 public:
  /// `supply` must outlive this object. Null: there are no alarms.
  explicit AlarmSender(EventSupply* supply) : supply_(supply) {}

  void StartAnew();
  /// Returns the alarm to send next; null: there is no alarm to send now. Returns the same alarm
  /// until OnSent.
  const AlarmSample* Next();
  void OnSent();

 private:
  EventSupply* const supply_;
  std::uint64_t version_ = 0;
  std::vector<EventSupply::Alarm> batch_;
  std::size_t next_ = 0;
};

class NoticeSender {
 public:
  /// Running subscribers on a network without faults discover a new gateway within this time.
  static constexpr Duration kDiscoveryTime = 500ms;
  /// All running subscribers discover a new gateway within this time. Events wait for this time
  /// unless a reader of events is discovered earlier. Example: 3,000 events wait and the DDS writer
  /// stores 1,000. If they were sent immediately, the oldest 2,000 would be lost before the first
  /// reader is discovered.
  static constexpr Duration kMeetingTime = 15s;

  /// The references and `events` must outlive this object. `now` is published as the gateway's
  /// start. `events` null: there are no events and alarms.
  NoticeSender(const config::Config& config, const bus::PointStore& store, PacedWriter& paced,
               EventSupply* events, Now now);

  /// To be called when a new session has begun: all events, alarms and the start of the gateway
  /// become due. `same` true: SampleWriter::Reopen has only replaced the writers, so the gateway's
  /// start and the final samples are not repeated.
  void StartAnew(Instant now, bool same = false);
  PointEnds& ends() { return ends_; }
  DeviceEnds& device_ends() { return device_ends_; }
  bool EndsAreTold() const { return ends_.empty() && device_ends_.empty(); }
  /// Makes the final samples due at the time `at`, also those that wait for a retry.
  void SendEndsAt(Instant at) { ends_due_ = at; }

  /// Sends at most 64 samples of each kind. False: the pacer or the writer accepts no more now.
  bool Send(Instant now);
  Instant Due();

  /// Sends the remaining events and alarms at the permitted rate, for at most 700 ms. Returns the
  /// time of the next call; nothing: all samples were sent, or they cannot be sent.
  std::optional<Instant> End(Instant now);
  /// Stores that subscribers have acknowledged everything. To be called after End.
  void Confirm() { events_.Confirm(); }

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
  Instant gateway_due_;  ///< time of the next attempt; Instant::max(): the gateway's start was sent
  PointEnds ends_;
  DeviceEnds device_ends_;
  Instant ends_due_{};  ///< final samples are not sent before this time
  EventSender events_;
  Instant events_due_;
  Instant meets_until_;
  AlarmSender alarms_;
  Instant alarms_due_;
  std::optional<Instant> end_by_;  ///< the time when End gives up; empty: End was not called yet
};

}  // namespace baudgate::dds
