// The audit as gateway/outputs/status and gateway/outputs/control see it. From any thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gateway/records/audit/write_page.h"
#include "gateway/records/disk/disk.h"

namespace baudgate::audit {

struct AuditState {
  Disk disk = Disk::opening;
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
  virtual std::optional<PastRequests> Past() const = 0;
};

/// `source` null: no records are kept.
inline std::optional<PastRequests> PastOf(const AuditSource* source) {
  return source != nullptr ? source->Past() : PastRequests();
}

}  // namespace baudgate::audit
