// The position of each consumer of all events, by its name, kept in the file: after a restart it
// goes on where it was. From any thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "gateway/base/guarded.h"

namespace baudgate::events {

/// The gateway's own consumers. The names stand in the file.
inline constexpr char kDdsConsumer[] = "dds";

struct Cursor {
  std::int64_t seq = 0;  ///< it has got this event, and all before
  /// It has confirmed them. Else the last ones may have been lost on their way when the gateway was
  /// killed.
  bool sure = false;

  bool operator==(const Cursor&) const = default;
};

using Cursors = std::map<std::string, Cursor>;

class CursorBook {
 public:
  /// The consumers. A cursor in the file of any other name is dropped.
  explicit CursorBook(std::set<std::string> consumers = {}) : consumers_(std::move(consumers)) {}

  /// Empty: it never got an event, or is no consumer.
  std::optional<Cursor> Of(const std::string& consumer) const;
  /// On the disk within a second or so. True: there is a change for the file now, and there was
  /// none before.
  bool Set(const std::string& consumer, Cursor cursor);

  // The rest is for the thread that writes the file.

  /// `due` is called on any thread when there is a change for the file. Null: nobody writes it;
  /// when this returns, the one before is not called any more.
  void OnDue(std::function<void()> due);
  /// What the file holds. What is known here takes precedence.
  void OnOpened(const Cursors& kept);
  /// All cursors, if the file differs; it is to hold no others.
  std::optional<Cursors> Due() const;
  void OnKept(const Cursors& kept);
  Cursors all() const;

 private:
  const std::set<std::string> consumers_;
  mutable Mutex mutex_;
  Cursors cursors_ BAUDGATE_GUARDED_BY(mutex_);
  Cursors kept_ BAUDGATE_GUARDED_BY(mutex_);
  Mutex telling_;
  std::function<void()> due_ BAUDGATE_GUARDED_BY(telling_);
};

}  // namespace baudgate::events
