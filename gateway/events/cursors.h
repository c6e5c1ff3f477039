// How far each consumer of all events has come, by its name, kept in the file: over restarts it
// goes on where it was. From any thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "gateway/base/guarded.h"

namespace baudgate::events {

/// The gateway's own consumers. The names stand in the file.
inline constexpr char kDdsConsumer[] = "dds";

struct Cursor {
  std::int64_t seq = 0;  ///< it has been given this, and all before
  /// And has confirmed it; otherwise the last may have been lost on their way when the gateway was
  /// killed.
  bool sure = false;

  bool operator==(const Cursor&) const = default;
};

using Cursors = std::map<std::string, Cursor>;

class CursorBook {
 public:
  /// Whoever is not named here has none: what the file holds of him is forgotten.
  explicit CursorBook(std::set<std::string> consumers = {}) : consumers_(std::move(consumers)) {}

  /// Nothing: it has never had an event, or is no consumer.
  std::optional<Cursor> Of(const std::string& consumer) const;
  /// True: the file has to hear of it, and had nothing to hear of before.
  bool Set(const std::string& consumer, Cursor cursor);

  /// What the file holds. What is known here goes before.
  void OnOpened(const Cursors& kept);
  /// All, where the file does not have them so; the only ones that it is to hold.
  std::optional<Cursors> Due() const;
  void OnKept(const Cursors& kept);
  Cursors all() const;

 private:
  const std::set<std::string> consumers_;
  mutable Mutex mutex_;
  Cursors cursors_ BAUDGATE_GUARDED_BY(mutex_);
  Cursors kept_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::events
