// Equal writes, folded into one record: writes of one client (its address, with any port) to one
// register, with one outcome and one reason. The first is recorded at once; those within a minute
// after it change its count, its last value and time. Bounded: the
// registers of one client beyond a limit share one record; clients beyond a limit share one record
// of each kind. No thread, no clock.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <string>

#include "gateway/records/audit/audit_book.h"

namespace baudgate::audit {

class Repeats {
 public:
  /// After this time a record takes no more repeats.
  static constexpr Duration kWindow = 1min;
  /// The most open records of a kind, and of these of one client address, apart from those that the
  /// rest share.
  static constexpr std::size_t kMost = 1024;
  static constexpr std::size_t kMostOfClient = 64;
  /// What stands for the rest.
  static constexpr const char* kManyPoints = "many points";
  static constexpr const char* kManyClients = "many others";

  explicit Repeats(AuditBook& book) : book_(book) {}

  /// `record.end` is known. The first one is put into the book at once.
  void Add(WriteRecord record, Instant now);
  /// Hands changed records to the book, and closes those that were open for long enough. Call it
  /// about once a second.
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
