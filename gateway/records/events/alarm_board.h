// The alarms as they are on the disk, for outputs, which never wait for the disk. Each change has a
// version, so an output that has come to one gets the newer ones. From any thread.
//
//   Update(a active), Update(b active), Update(a acknowledged)
//   Take(0)   → b active, a acknowledged
//   Take(2)   → a acknowledged
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/records/events/alarm.h"

namespace baudgate::events {

class AlarmBoard {
 public:
  /// The most alarms that are known; beyond it the oldest normal ones are forgotten.
  static constexpr std::size_t kMost = 10'000;

  void Update(const Alarm& alarm);

  struct Change {
    std::uint64_t version = 0;
    Alarm alarm{};  ///< as it is now; may be normal
  };
  /// Alarms that have changed after version `after`, in order of their versions.
  std::vector<Change> Take(std::uint64_t after, std::size_t most) const;

 private:
  void Forget() BAUDGATE_REQUIRES(mutex_);

  mutable Mutex mutex_;
  std::uint64_t version_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::map<AlarmKey, Change> alarms_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<std::uint64_t, AlarmKey> by_version_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::events
