// Writes that come again and again, folded into one record: those of one client (its address,
// whatever its port) to one register, with one outcome and for one reason. The first is recorded at
// once; what follows within a minute changes its count, its last value and time. Bounded: the
// registers of one client beyond a limit share one record; clients beyond a limit share one record
// of each kind. No thread, no clock.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <string>

#include "gateway/audit/audit_book.h"

namespace baudgate::audit {

class Repeats {
 public:
  /// A record takes no repeats after that.
  static constexpr Duration kWindow = 1min;
  /// Records of a kind that may be open at a time, and of those the ones of one client address;
  /// beside those that the rest share.
  static constexpr std::size_t kMost = 1024;
  static constexpr std::size_t kMostOfClient = 64;
  /// What stands for the rest.
  static constexpr const char* kManyPoints = "many points";
  static constexpr const char* kManyClients = "many others";

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
    bool shared = false;  // by the rest
  };
  using Key = std::string;

  /// With what cannot have a record of its own taken out.
  WriteRecord Shared(WriteRecord record) const;
  void Count(const Open& open, bool more);

  AuditBook& book_;
  std::map<Key, Open> open_;
  // For records that are not shared.
  std::array<std::size_t, kKinds> of_kind_{};
  std::map<Key, std::size_t> of_client_;  // by kind and address
};

/// "192.0.2.5" of "192.0.2.5:40312"; a client that is no address stays as it is.
std::string AddressOf(const std::string& client);

}  // namespace baudgate::audit
