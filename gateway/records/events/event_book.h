// `EventBook` contains events that are not on the disk yet. The writing thread takes them from
// here; while the disk fails, they wait here. `EventBook` assigns the event numbers and detects a
// batch that a device sends twice. No thread, no lock, no disk: gateway/records/events/event_log.h
// provides these.
//
//   Add({source 3, "12.345 0E1", again, {r}})
//   Prepare() → {source 3, {r, seq 1}}   to be inserted; without events if the last stored batch of
//                                        this source has the same text
//   Kept()    → {"bay-1", "feeder-2"}    the device may be asked for more events
//
// The number of events is limited: a device is not asked for more events before its batch is
// stored, so at most one batch of each device waits. The gateway's own events cannot be delayed in
// this way. They are limited by `Shares` for each kind, and by kMostOwn for all.
//
// Alarms exist in three versions: `alarms_` are on the disk, `after_.alarms` are changes of the
// transaction that is being written, and `expected_` are changes of that transaction and of all
// batches that wait. Outputs use AlarmBoard (gateway/records/events/alarm.h) instead.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/records/events/event_record.h"

namespace baudgate::events {

// `Shares` limits how many events of one kind are stored, so that an input that changes all the
// time does not displace other events. A kind is one code of one device, port or point. Twenty
// events are stored at once, then one a minute. Further events are left out, except the last event,
// so that the log ends with the present state. The last event is stored when the next minute
// permits it, or when no event of its kind has come for the settling time: 2 s at first, doubled
// each time up to a minute.
//
//   61 x tripped, reset within seconds     20 of them are stored
//   2 s later                              "40 events like the next left out", and the last event
class Shares {
 public:
  static constexpr int kAtOnce = 20;
  static constexpr Duration kEach = std::chrono::minutes(1);
  static constexpr Duration kSettles = std::chrono::seconds(2);

  /// Returns false if the event is left out. `room`: true if the book has room for another event.
  bool Take(const EventRecord& record, bool room, Instant now);
  /// To be called when an accepted event is on the disk. At most kAtOnce events of a kind can wait
  /// for the disk.
  void OnKept(const EventRecord& record);
  /// Returns what can be stored now for the left-out events: for each kind an event with their
  /// number, then the last left-out event. `all`: for all kinds, at the end of the program.
  std::vector<EventRecord> TakeLeftOut(Now now, bool all = false);
  std::optional<Instant> NextAt() const;

  /// The number of left-out events since the start.
  std::uint64_t left_out() const { return left_out_; }

 private:
  using Key = std::tuple<std::string, std::string, std::uint32_t, std::string>;
  struct Share {
    int left = kAtOnce;
    Instant filled{};
    int waiting = 0;
    std::uint64_t left_out = 0;
    WallTime since{};
    EventRecord last{};
    Instant last_at{};
    Duration settles = kSettles;

    Instant SettledAt() const { return last_at + settles; }
  };
  static Key KeyOf(const EventRecord& record);
  static void Fill(Share& share, Instant now);

  std::map<Key, Share> shares_;
  std::uint64_t left_out_ = 0;
};

using Source = std::uint32_t;  ///< index of a device in the point store
inline constexpr Source kGateway = ~Source{0};

/// The names of line and device. Stored data refers to a source by these names, because a reload
/// changes numbers.
using SourceName = std::pair<std::string, std::string>;
/// EventBatch::said of the last stored batch of each source.
using Said = std::map<SourceName, std::string>;

struct Batch {
  Source source = 0;   ///< number of the source at the time of Add; a reload can change it
  std::string said{};  ///< the device's identification of the batch; see EventBatch::said
  bool again = false;
  std::vector<EventRecord> events{};
  std::vector<protocols::PastRecord> past{};
  bool told = false;  ///< the alarms of the batch were reported before it was stored
  std::string line{};
  std::string device{};

  SourceName name() const { return {line, device}; }
};

class EventBook {
 public:
  /// The limit of the gateway's own events that wait: some megabytes.
  static constexpr std::size_t kMostOwn = 10'000;

  void Add(Batch batch);
  /// Adds an event of the gateway, or leaves it out; see Shares.
  void Tell(EventRecord record, Instant now);
  void TellAlways(EventRecord record);
  /// Adds an event of the gateway before all events that wait. Must not be called between Prepare
  /// and Kept.
  void TellFirst(EventRecord record);
  void TellLeftOut(Now now, bool all = false);
  std::optional<Instant> LeftOutAt() const { return shares_.NextAt(); }

  /// Adds the content of the opened file. Data that the book already contains takes precedence,
  /// because the file can be new. `last`: the number of the last event in the file.
  void OnOpened(std::int64_t last, const Said& said, const std::vector<Alarm>& alarms = {});

  /// Assigns numbers and new alarm states to the events of all batches that wait, and returns these
  /// batches in the order of Add. Call OnOpened first. Until Kept is called, Prepare returns the
  /// same batches again.
  std::vector<Batch> Prepare();
  /// Does the same as Prepare, but can be called while the batches of the last Prepare are being
  /// written.
  std::vector<Batch> Ahead();
  /// Copies the `told` flags of the first waiting batches to `batches`.
  void TakeTold(std::vector<Batch>& batches) const;
  /// To be called when the first `batches` batches of the last Prepare are on the disk. Returns
  /// their sources in order, without kGateway.
  std::vector<SourceName> Kept(std::size_t batches);

  void OnTold(std::size_t batches);

  bool opened() const { return opened_; }
  bool empty() const { return waiting_.empty(); }
  std::string said(const SourceName& source) const;
  /// The number of waiting batches of devices.
  std::size_t waiting() const { return waiting_.size() - own_; }
  std::size_t waiting_own() const { return own_; }
  std::uint64_t left_out() const { return shares_.left_out(); }
  std::int64_t newest() const { return last_; }
  std::uint64_t repeats() const { return repeats_; }
  const std::map<AlarmKey, Alarm>& alarms() const { return alarms_; }
  /// Returns the alarms as they will be when all batches of the last Prepare or Ahead are stored.
  std::map<AlarmKey, Alarm> Expected() const;
  std::vector<Alarm> Alarms(bool expected) const;
  static constexpr std::size_t kMostAlarms = 10'000;

 private:
  bool IsRepeat(const Batch& batch, const Said& said) const;

  struct After {
    std::int64_t last = 0;
    Said said{};
    std::uint64_t repeats = 0;
    std::map<AlarmKey, Alarm> alarms{};
  };
  bool Counts(EventRecord& event);
  const Alarm* Find(const AlarmKey& key) const;

  std::deque<Batch> waiting_;
  std::size_t own_ = 0;
  Shares shares_;
  Said said_;
  std::int64_t last_ = 0;
  std::uint64_t repeats_ = 0;
  std::map<AlarmKey, Alarm> alarms_;
  bool opened_ = false;
  After after_;
  std::map<AlarmKey, Alarm> expected_;
};

// `SourceNumbers` maps the numbers of sources to names. A reload changes the numbers.

using SourceNames = std::vector<SourceName>;

class SourceNumbers {
 public:
  explicit SourceNumbers(SourceNames names) : names_(std::move(names)) {}

  void Renew(SourceNames names) { names_ = std::move(names); }
  SourceName NameOf(Source source) const {
    return source < names_.size() ? names_[source] : SourceName();
  }
  std::optional<Source> Find(const SourceName& name) const {
    const auto found = std::ranges::find(names_, name);
    if (found == names_.end()) return std::nullopt;
    return static_cast<Source>(found - names_.begin());
  }

 private:
  SourceNames names_;
};

}  // namespace baudgate::events
