// Writes that come again and again, folded into one record: those of one client (its address,
// whatever its port) to one register, with one outcome. The first is recorded at once; what follows
// within a minute changes its count, its last value and time. Bounded: where too many clients
// write, those beyond share one record of each kind. No thread, no clock.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "gateway/audit/audit_book.h"

namespace baudgate::audit {

class Repeats {
 public:
  /// A record takes no repeats after that.
  static constexpr Duration kWindow = 1min;
  /// Records that may be open at a time, beside those that the rest share.
  static constexpr std::size_t kMost = 1024;
  /// Client of those that share one.
  static constexpr const char* kOthers = "many others";

  explicit Repeats(AuditBook& book) : book_(book) {}

  /// `record.end` is known. Reaches the book at once where it is the first.
  void Add(WriteRecord record, Instant now);
  /// Hands what has changed to the book, and closes what has been open for long enough. To be
  /// called about once a second.
  void Tick(Instant now);
  /// The program ends: closes all.
  void Close();

  bool empty() const { return open_.empty(); }

 private:
  struct Open {
    WriteRecord record;
    Ticket ticket = 0;
    Instant until;
    bool changed = false;
  };

  AuditBook& book_;
  std::map<std::string, Open> open_;
};

/// "192.0.2.5" of "192.0.2.5:40312"; a client that is no address stays as it is.
std::string AddressOf(const std::string& client);

}  // namespace baudgate::audit
