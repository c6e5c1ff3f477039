// `AuditSource` is the audit for its readers, gateway/outputs/status and gateway/outputs/control.
// May be used on any thread. `ReadPage` reads the records page by page.
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

// ReadPage reads the records of the audit, page by page, for `baudgate writes`, in its own
// connection, so it delays no writer. The file may contain anything; every field is checked.

/// Records of one page: a line of the control socket with about 40 kB, 1 MB at most.
inline constexpr std::size_t kPage = 100;

struct PageQuery {
  /// seq: all records, in the order of the requests. settled: records that have ended, in the order
  /// of their ends; no record appears later before one that was read already.
  enum class Order : std::uint8_t { seq, settled } order = Order::seq;
  std::int64_t after = 0;         ///< the number in that order after which the page begins
  std::optional<WallTime> since;  ///< only writes requested at this time or later
};

struct Page {
  std::vector<WriteRecord> records;
  std::int64_t next = 0;  ///< `after` of the next page
  bool more = false;      ///< more records existed when the page was read
};

Result<Page> ReadPage(records::Database& database, const PageQuery& query);
/// Returns the latest writes to points of each client that numbers its requests, the latest first.
/// `now` is used to compute their age.
Result<std::vector<bus::PastRequest>> ReadRequests(records::Database& database, WallTime now);
/// Reads a page of the file; see ReadOnce.
Result<Page> ReadPage(const std::filesystem::path& file, const PageQuery& query,
                      bool* damaged = nullptr);

struct AuditState {
  records::Disk disk = records::Disk::opening;
  std::string trouble;      ///< why the disk fails; empty: it does not
  WallTime since{};         ///< since when `disk` has its value
  bool require = false;     ///< writes are refused while the disk fails
  std::size_t waiting = 0;  ///< records that are in memory only
  std::uint64_t lost = 0;   ///< records for which there was no room
  std::string file;
  std::vector<std::string> put_aside{};  ///< names of damaged files that still exist
};

class AuditSource {
 public:
  virtual ~AuditSource() = default;
  virtual AuditState state() const = 0;
  /// The page is empty while the file is being opened, which may take as long as reading the file.
  virtual Result<Page> Read(const PageQuery& query) const = 0;
  /// The requests of earlier runs. Not set: they are not known yet. Until then a request with a
  /// number must not be carried out, because an earlier run may have done so.
  virtual std::optional<bus::PastRequests> Past() const = 0;
};

/// `source` null: no records are stored.
inline std::optional<bus::PastRequests> PastOf(const AuditSource* source) {
  return source != nullptr ? source->Past() : bus::PastRequests();
}

}  // namespace baudgate::audit
