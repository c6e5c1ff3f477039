// Whose turn it is to use events.db: the audit and the events have a connection and a thread each,
// and SQLite lets one of them write at a time. Who comes second would be told "busy" after 250 ms,
// which the disk may well take, so they wait for each other here instead, first come first served.
// Neither has to know of the other's tables, and what the audit holds up (a start with "audit:
// require") does not wait behind a queue of events: behind one commit at most.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>

#include "gateway/base/guarded.h"
#include "gateway/base/result.h"

namespace baudgate {

/// From any thread.
class FileTurn {
 public:
  class Hold {
   public:
    explicit Hold(FileTurn& turn) : turn_(turn) { turn_.Take(); }
    ~Hold() { turn_.Give(); }
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

   private:
    FileTurn& turn_;
  };

  /// What must be so before the file is opened: its folder is there, and ours. Empty: nothing.
  std::function<Status()> ready;
  /// How often the file has been put aside. With a Hold.
  std::uint64_t file = 0;

 private:
  void Take();
  void Give();

  Mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t next_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::uint64_t serving_ BAUDGATE_GUARDED_BY(mutex_) = 0;
};

}  // namespace baudgate
