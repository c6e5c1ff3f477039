// The table `alarms` of events.db: alarms that are not normal. Written in the transaction of the
// event that has changed them. One thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gateway/records/disk/database.h"
#include "gateway/records/events/alarm.h"

namespace baudgate::events {

class AlarmTable {
 public:
  /// `database` outlives it.
  explicit AlarmTable(Database& database);

  bool Read(std::vector<Alarm>& alarms);
  /// A normal one is removed.
  bool Write(const Alarm& alarm);

 private:
  Database& database_;
  Statement write_;
  Statement remove_;
};

}  // namespace baudgate::events
