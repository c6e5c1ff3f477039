// `RecordService` reads the record that belongs to an event once, after the event. Example: the
// values that a relay has recorded of a trip. The points of the record are read like the reads that
// a user requests (WriteCommand::reads), and are stored as one record
// (gateway/records/events/event_record.h). In this table, the left column shows what happens;
// "drained" is a call of OnDrained: the device has no more events.
//
//   event 412 is on the disk, needs "trip"  waits until the relay is drained, at most 5 s
//   drained                                 the points of the record are requested
//   all points are read                     the values wait until the relay is drained again
//   drained                                 stored with 412: the values can be of no later event
//   instead, event 413 needs "trip", too    412 is superseded and its values are dropped; as above
//   some points could not be read           tried again after 5 s when the device answers; 5 tries
//   restart in between                      all begins again: the file lists events without record
//   its line is reloaded                    all begins again: the device has another number
//
// While the device does not answer, nothing is requested from it. Its records are read when it
// answers again.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/records/events/event_record.h"

namespace baudgate::events {

/// Thread-safe.
class RecordService {
 public:
  static constexpr int kTries = 5;
  static constexpr Duration kAgain = 5s;
  static constexpr Duration kWaitForPoints = 30s;
  /// If the device is not drained (OnDrained) for this time after its values were read, the values
  /// are stored with quality "uncertain", because they may belong to a later event.
  static constexpr Duration kUnproven = 1min;

  struct Ends {
    std::function<Now()> clocks;
    /// Requests the reads of a record; see CommandSink::Submit.
    std::function<bool(bus::WriteCommand command)> ask;
    std::function<void(events::KeptRecord record)> keep;
  };
  /// `store` must outlive this object. All requested reads must be answered before this object is
  /// destroyed.
  RecordService(const bus::PointStore& store, Ends ends) : store_(store), ends_(std::move(ends)) {}

  void Add(const std::shared_ptr<const config::Line>& line);

  void Start();

  /// To be called after a reload: records of removed devices that are still to be read are assigned
  /// to new devices of the same names.
  void TakeOver();

  void Owe(const std::vector<events::OwedRecord>& owed);
  /// See the functions of PollerListener with these names.
  void OnDrained(std::uint32_t device, Instant asked);
  void OnRead(std::uint32_t device, Instant at);

 private:
  struct Debt {
    std::uint32_t device = 0;
    std::shared_ptr<const config::Record> record;  ///< null: the device was removed by a reload
    std::optional<events::OwedRecord> event{};
    bool asking = false;
    bool waits = false;  ///< reading waits until the device has no more events
    bool stale = false;  ///< values being read may belong to the previous event
    int tries = 0;
    Instant again{};
    std::optional<events::KeptRecord> got{};
    Instant got_at{};
  };
  struct Asking {
    Debt* debt = nullptr;
    std::shared_ptr<const config::Record> record;
  };
  struct Steps {
    std::vector<Asking> ask{};
    std::vector<events::KeptRecord> keep{};
  };

  Debt* Find(const events::OwedRecord& owed) BAUDGATE_REQUIRES(mutex_);
  void OnAnswer(Debt& debt, Instant asked, const WriteResult& result);
  struct Found {
    bool away = false;  ///< true: the device is offline, or another device is in its place
    std::optional<events::KeptRecord> record{};
    Instant read_at{};
  };
  Found Look(std::uint32_t device, const config::Record& record, Instant asked, Now now) const;
  static void Settle(Debt& debt, const events::KeptRecord& record, Steps& steps);
  void Ask(Debt& debt, Steps& steps) BAUDGATE_REQUIRES(mutex_);
  void Do(Steps steps);

  const bus::PointStore& store_;
  const Ends ends_;
  std::atomic<std::size_t> owing_ = 0;
  mutable Mutex mutex_;
  bool started_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::vector<std::vector<Debt>> debts_ BAUDGATE_GUARDED_BY(mutex_);  // index: number of the device
};

}  // namespace baudgate::events
