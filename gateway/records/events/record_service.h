// Reads the records that events owe: the values that a relay has recorded of a trip, once, after
// the event. They are read as a person reads points (WriteCommand::reads) and kept as one record
// (gateway/records/events/event_record.h).
//
//   event 412 is on the disk, owes "trip"   waits until the relay has no more events, at most 5 s
//   L: nothing                              its points are asked for
//   they are all read                       they wait for the next L
//   L: nothing                              kept with 412: they can be of no later event
//   L: 413 owes "trip", too                 412 is superseded, what was read is dropped; as above
//   not all could be read                   again 5 s later when the device answers, five times
//   restart in between                      the file knows what is owed: from the beginning
//   its line is reloaded                    the device has another number: from the beginning, too
//
// Nothing is asked while the device does not answer; its records wait, and are read when it is
// back.
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

/// From any thread.
class RecordService {
 public:
  static constexpr int kTries = 5;
  static constexpr Duration kAgain = 5s;
  static constexpr Duration kWaitForPoints = 30s;
  /// If a device with events has not reported for this long that there are no more, the values that
  /// were read may belong to a later event.
  static constexpr Duration kUnproven = 1min;

  struct Ends {
    std::function<Now()> clocks;
    std::function<bool(bus::WriteCommand command)> ask;  ///< as CommandSink::Submit
    std::function<void(events::KeptRecord record)> keep;
  };
  /// `store` outlives it. All its reads must be answered before it is destroyed.
  RecordService(const bus::PointStore& store, Ends ends) : store_(store), ends_(std::move(ends)) {}

  /// The next devices after the known ones.
  void Add(const std::shared_ptr<const config::Line>& line);

  /// From now on lines may be asked.
  void Start();

  /// A reload has ended: the debts of devices that are gone pass to new devices of the same names.
  void TakeOver();

  /// These events are on the disk, and their records are not.
  void Owe(const std::vector<events::OwedRecord>& owed);
  /// See PollerListener.
  void OnDrained(std::uint32_t device, Instant asked);
  /// The device has answered.
  void OnRead(std::uint32_t device, Instant at);

 private:
  struct Debt {
    std::uint32_t device = 0;
    std::shared_ptr<const config::Record>
        record;  ///< null: the device is gone, and a reload has ended
    std::optional<events::OwedRecord> event{};  ///< the last that owes it
    bool asking = false;
    bool waits = false;  ///< until the device has no more events
    bool stale = false;  ///< the reading may belong to the event before
    int tries = 0;
    Instant again{};  ///< not before
    std::optional<events::KeptRecord> got{};
    Instant got_at{};
  };
  /// Calls to make when the lock is free again.
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
    bool away = false;  ///< the device, or another one is in its place
    std::optional<events::KeptRecord> record{};
    Instant read_at{};  ///< of its latest value
  };
  Found Look(std::uint32_t device, const config::Record& record, Instant asked, Now now) const;
  static void Settle(Debt& debt, const events::KeptRecord& record, Steps& steps);
  void Ask(Debt& debt, Steps& steps) BAUDGATE_REQUIRES(mutex_);
  void Do(Steps steps);

  const bus::PointStore& store_;
  const Ends ends_;
  std::atomic<std::size_t> owing_ = 0;  // debts
  mutable Mutex mutex_;
  bool started_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::vector<std::vector<Debt>> debts_ BAUDGATE_GUARDED_BY(mutex_);  // by device; never moved
};

}  // namespace baudgate::events
