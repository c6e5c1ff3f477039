// The audit as gateway/outputs/status and gateway/outputs/control see it. From any thread. ReadPage
// reads the records page by page.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/records/audit/audited_writes.h"
#include "gateway/records/disk/database.h"
#include "gateway/records/disk/disk.h"

namespace baudgate::audit {

// Reads the records of the audit, page by page, for `baudgate writes`: over a connection of its
// own, so nothing waits for it. The file may contain anything; every field is checked.

/// Records of one page: a line of the control socket of about 40 kB, 1 MB at most.
inline constexpr std::size_t kPage = 100;

struct PageQuery {
  /// seq: all records, in the order of the requests. settled: those that have ended, in the order
  /// of their ends; a record never appears before one that was read already.
  enum class Order : std::uint8_t { seq, settled } order = Order::seq;
  std::int64_t after = 0;         ///< a number in that order
  std::optional<WallTime> since;  ///< only writes requested at this time or later
};

struct Page {
  std::vector<WriteRecord> records;
  std::int64_t next = 0;  ///< `after` of the next page
  bool more = false;      ///< there were more at that time
};

Result<Page> ReadPage(records::Database& database, const PageQuery& query);
/// The latest writes to points of each client that numbers its requests, the latest first. `now`:
/// for their age.
Result<std::vector<bus::PastRequest>> ReadRequests(records::Database& database, WallTime now);
/// See ReadOnce.
Result<Page> ReadPage(const std::filesystem::path& file, const PageQuery& query,
                      bool* damaged = nullptr);

struct AuditState {
  records::Disk disk = records::Disk::opening;
  std::string trouble;      ///< why it fails; empty: it does not
  WallTime since{};         ///< of `disk`
  bool require = false;     ///< writes are refused while it fails
  std::size_t waiting = 0;  ///< records that are in memory only
  std::uint64_t lost = 0;   ///< records for which there was no room
  std::string file;
  std::vector<std::string> put_aside{};  ///< damaged files that are still there, by name
};

class AuditSource {
 public:
  virtual ~AuditSource() = default;
  virtual AuditState state() const = 0;
  /// Empty while the file is being opened, which may take as long as reading it.
  virtual Result<Page> Read(const PageQuery& query) const = 0;
  /// The requests of earlier runs. Not set: they are not known yet. Until then a request with a
  /// number must not be carried out, because an earlier run may have done so.
  virtual std::optional<bus::PastRequests> Past() const = 0;
};

/// `source` null: no records are kept.
inline std::optional<bus::PastRequests> PastOf(const AuditSource* source) {
  return source != nullptr ? source->Past() : bus::PastRequests();
}

}  // namespace baudgate::audit
