// Events that are not on the disk yet: the writing thread takes them from here, and they wait here
// while the disk fails. Gives out the numbers, and recognises a batch that comes twice. No thread,
// no lock, no disk: gateway/records/events/event_log.h has them.
//
//   Add({source 3, "12.345 0E1", again, {r}})
//   Prepare() → {source 3, {r, seq 1}}   to be inserted; without events if the last batch that was
//                                        kept of this source said the same
//   Kept()    → {"bay-1", "feeder-2"}    it may be asked for more
//
// Bounded: a source is not asked again before its batch is kept, so at most one of each waits. The
// gateway's own events have no source that could be made to wait: they are limited by their shares,
// and by a limit for all.
//
// Alarms are kept in three states: `alarms_` are on the disk, `after_.alarms` are changed by the
// transaction that is being written, `expected_` by that and by all that waits. For outputs there
// is gateway/records/events/alarm.h.
//
// Shares limits events of one kind, and SourceNumbers keeps the names of sources.
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

// How many events of one kind are kept: a kind is one code of one device, port or point. One that
// flaps must not crowd out the others. Twenty at once, then one a minute. The rest is left out,
// except the last one, so that the log ends with the present state: it is kept in its minute, or as
// soon as the state has settled, which takes two seconds, and twice as long each time.
//
//   61 x tripped, reset within seconds     20 of them
//   2 s later                              "40 events like the next left out", and the last
class Shares {
 public:
  static constexpr int kAtOnce = 20;
  static constexpr Duration kEach = std::chrono::minutes(1);
  static constexpr Duration kSettles = std::chrono::seconds(2);

  /// False: it is left out. `room`: whether there is room at all.
  bool Take(const EventRecord& record, bool room, Instant now);
  /// One that was taken is on the disk: the number of each kind that may wait is limited.
  void OnKept(const EventRecord& record);
  /// Returns what may be kept by now of those that were left out: their number, then the last of
  /// them. `all`: at the end of the program.
  std::vector<EventRecord> TakeLeftOut(Now now, bool all = false);
  /// When there may be some; empty: none was left out.
  std::optional<Instant> NextAt() const;

  std::uint64_t left_out() const { return left_out_; }  ///< since the start

 private:
  using Key = std::tuple<std::string, std::string, std::uint32_t, std::string>;
  struct Share {
    int left = kAtOnce;
    Instant filled{};  ///< when `left` last became more
    int waiting = 0;   ///< for the disk
    std::uint64_t left_out = 0;
    WallTime since{};  ///< of the first of them
    EventRecord last{};
    Instant last_at{};
    Duration settles = kSettles;

    Instant SettledAt() const { return last_at + settles; }
  };
  static Key KeyOf(const EventRecord& record);
  static void Fill(Share& share, Instant now);

  std::map<Key, Share> shares_;  // bounded by the configuration
  std::uint64_t left_out_ = 0;
};

using Source = std::uint32_t;  ///< a device, as in the point store
inline constexpr Source kGateway = ~Source{0};

/// Line and device. A reload gives a source another number, so what is remembered of it, here and
/// in the file, goes by its name.
using SourceName = std::pair<std::string, std::string>;
/// The text of the last batch of each source.
using Said = std::map<SourceName, std::string>;

struct Batch {
  Source source = 0;   ///< at the time of Add; a reload may have changed it since
  std::string said{};  ///< see EventBatch
  bool again = false;
  std::vector<EventRecord> events{};
  std::vector<protocols::PastRecord> past{};
  bool told = false;  ///< its alarms were reported already, although it is not on the disk yet
  std::string line{};
  std::string device{};

  SourceName name() const { return {line, device}; }
};

class EventBook {
 public:
  /// The most of the gateway's own events that wait: some megabytes.
  static constexpr std::size_t kMostOwn = 10'000;

  void Add(Batch batch);
  /// An event of the gateway's own. It may be left out, and told later.
  void Tell(EventRecord record, Instant now);
  /// The same, and never left out.
  void TellAlways(EventRecord record);
  /// The same, in front of all that waits. Not between Prepare and Kept.
  void TellFirst(EventRecord record);
  /// Adds what was left out and may be told by now.
  void TellLeftOut(Now now, bool all = false);
  std::optional<Instant> LeftOutAt() const { return shares_.NextAt(); }

  /// What the file holds: its last number, what each source said last, and the alarms. What the
  /// book knows itself takes precedence: the file may be a new one.
  void OnOpened(std::int64_t last, const Said& said, const std::vector<Alarm>& alarms = {});

  /// Gives what waits its numbers and the new states of alarms, and returns it in the order of Add.
  /// The same again until it is kept. After OnOpened.
  std::vector<Batch> Prepare();
  /// The same, while what Prepare returned last is still being written.
  std::vector<Batch> Ahead();
  /// Marks those of the first batches that wait whose alarms were reported meanwhile.
  void TakeTold(std::vector<Batch>& batches) const;
  /// The `batches` that Prepare returned last are on the disk. Returns their sources, in their
  /// order, without kGateway.
  std::vector<SourceName> Kept(std::size_t batches);

  /// The alarms of the first `batches` that wait were reported.
  void OnTold(std::size_t batches);

  bool opened() const { return opened_; }
  bool empty() const { return waiting_.empty(); }
  /// `said` of the last batch of the source that is kept; empty: none is.
  std::string said(const SourceName& source) const;
  std::size_t waiting() const { return waiting_.size() - own_; }  ///< of devices
  std::size_t waiting_own() const { return own_; }
  std::uint64_t left_out() const { return shares_.left_out(); }
  std::int64_t newest() const { return last_; }       ///< that is on the disk
  std::uint64_t repeats() const { return repeats_; }  ///< events that came once more
  /// Alarms on the disk that are active or unacknowledged.
  const std::map<AlarmKey, Alarm>& alarms() const { return alarms_; }
  /// As they will be when all that Prepare or Ahead returned last is kept.
  std::map<AlarmKey, Alarm> Expected() const;
  /// `expected`: as they will be, else as they are on the disk.
  std::vector<Alarm> Alarms(bool expected) const;
  static constexpr std::size_t kMostAlarms = 10'000;

 private:
  bool IsRepeat(const Batch& batch, const Said& said) const;

  /// What Kept makes true.
  struct After {
    std::int64_t last = 0;
    Said said{};
    std::uint64_t repeats = 0;
    std::map<AlarmKey, Alarm> alarms{};  // that have changed
  };
  bool Counts(EventRecord& event);
  const Alarm* Find(const AlarmKey& key) const;

  std::deque<Batch> waiting_;
  std::size_t own_ = 0;  // of them
  Shares shares_;
  Said said_;  // kept
  std::int64_t last_ = 0;
  std::uint64_t repeats_ = 0;
  std::map<AlarmKey, Alarm> alarms_;
  bool opened_ = false;
  After after_;
  std::map<AlarmKey, Alarm> expected_;  // that will have changed
};

// The names of sources by their numbers, which a reload changes.

/// By number. A number whose source is gone has empty names.
using SourceNames = std::vector<SourceName>;

class SourceNumbers {
 public:
  explicit SourceNumbers(SourceNames names) : names_(std::move(names)) {}

  void Renew(SourceNames names) { names_ = std::move(names); }
  /// Empty names: no source has this number.
  SourceName NameOf(Source source) const {
    return source < names_.size() ? names_[source] : SourceName();
  }
  /// Empty: it is not configured any more.
  std::optional<Source> Find(const SourceName& name) const {
    const auto found = std::ranges::find(names_, name);
    if (found == names_.end()) return std::nullopt;
    return static_cast<Source>(found - names_.begin());
  }

 private:
  SourceNames names_;
};

}  // namespace baudgate::events
