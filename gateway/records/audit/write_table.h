// The table `writes` of events.db: records in, in one transaction, and the oldest out. One thread;
// gateway/records/audit/write_page.h reads it from another connection.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/records/audit/audit_book.h"
#include "gateway/records/disk/database.h"

namespace baudgate::audit {

/// How much is kept of a kind. Beyond `rows` the oldest record of the point with most records goes
/// first, so a client that writes to one point without end displaces no record of another.
struct Room {
  std::int64_t rows = 0;
  Duration age{};
};
inline constexpr Duration kDay = 24h;
/// By Kind: about 60 MB together.
inline constexpr std::array<Room, kKinds> kRooms = {
    Room{200'000, 5 * 366 * kDay}, Room{100'000, 400 * kDay}, Room{20'000, 400 * kDay},
    Room{20'000, 5 * 366 * kDay}};

/// Line and bare name of a device.
using Target = std::pair<std::string, std::string>;

class WriteTable {
 public:
  /// `database` is of OpenEvents, and outlives it.
  explicit WriteTable(Database& database, const std::array<Room, kKinds>& rooms = kRooms);

  /// Once, before anything else: writes that the last run began and did not end become unknown.
  /// Those to points are then in `unsettled()`.
  bool SettleOrphans();
  const std::set<Target>& unsettled() const { return unsettled_; }
  /// Writes all or none. Sets the seq of new ones.
  bool Write(std::vector<Draft>& drafts);
  /// Deletes records beyond the rows of their kind.
  bool MakeRoom();
  /// Deletes records that are older than their kind is kept.
  bool DropOld(WallTime now);

 private:
  bool Insert(Draft& draft);
  bool Update(const Draft& draft);
  bool TakeOut(std::size_t kind, std::int64_t rows);
  bool Count();
  bool Transaction(bool done);

  Database& database_;
  const std::array<Room, kKinds> rooms_;
  Statement insert_;
  Statement update_;
  std::array<std::int64_t, kKinds> rows_{};
  std::int64_t settled_ = 0;  // the last that was given
  std::set<Target> unsettled_;
};

}  // namespace baudgate::audit
