// `AuditSource` is the audit for its readers, gateway/outputs/status and gateway/outputs/control.
// Can be used on any thread.
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

// `ReadPage` reads the records of the audit, page by page, for `baudgate writes`. It uses a
// separate connection, so it delays no writer. The file may be damaged; every field is checked.

/// The number of records of one page, one line of the control socket: about 40 kB, at most 1 MB.
inline constexpr std::size_t kPage = 100;

struct PageQuery {
  /// seq: all records, in the order of the requests. settled: only records of writes that have
  /// ended, in the order in which they ended; a later page never contains a record that belongs
  /// before a record already read.
  enum class Order : std::uint8_t { seq, settled } order = Order::seq;
  std::int64_t after = 0;
  std::optional<WallTime> since;  ///< only writes requested at this time or later
};

struct Page {
  std::vector<WriteRecord> records;
  std::int64_t next = 0;
  bool more = false;
};

Result<Page> ReadPage(records::Database& database, const PageQuery& query);
/// Returns, for each client that numbers its requests, its last 33 writes to points; at most 8192
/// writes of all clients, the latest first. `now` is used to compute their age.
Result<std::vector<bus::PastRequest>> ReadRequests(records::Database& database, WallTime now);
/// Opens the file and reads a page. `damaged`: see ReadOnce (gateway/records/disk/database.h).
Result<Page> ReadPage(const std::filesystem::path& file, const PageQuery& query,
                      bool* damaged = nullptr);

struct AuditState {
  records::Disk disk = records::Disk::opening;
  std::string trouble;
  WallTime since{};
  bool require = false;     ///< true: writes are refused while the disk fails
  std::size_t waiting = 0;  ///< records that are in memory only
  std::uint64_t lost = 0;   ///< records that were lost because AuditBook::kLimits was reached
  std::string file;
  std::vector<std::string> put_aside{};
};

class AuditSource {
 public:
  virtual ~AuditSource() = default;
  virtual AuditState state() const = 0;
  /// Returns an empty page while the file is being opened, which can take as long as reading the
  /// whole file.
  virtual Result<Page> Read(const PageQuery& query) const = 0;
  /// Returns the requests with a number (bus::RequestId) of earlier runs; empty: they are not known
  /// yet. Until they are known, a request with a number must not be carried out, because an earlier
  /// run may have carried it out.
  virtual std::optional<bus::PastRequests> Past() const = 0;
};

/// `source` null: no writes are recorded, so there are no requests of earlier runs.
inline std::optional<bus::PastRequests> PastOf(const AuditSource* source) {
  return source != nullptr ? source->Past() : bus::PastRequests();
}

}  // namespace baudgate::audit
