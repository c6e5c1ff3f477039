// A disk for SQLite, in memory, that can be broken in every way that matters: it is full, it fails,
// it hangs, and its power is cut. After a cut only what was synced is there for certain; of the
// rest some writes are there, some are not, and some are torn.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <vector>

namespace baudgate::audit {

/// On such a disk.
inline constexpr const char* kEventsFile = "/events.db";

class FaultyDisk {
 public:
  FaultyDisk();
  ~FaultyDisk();
  FaultyDisk(const FaultyDisk&) = delete;
  FaultyDisk& operator=(const FaultyDisk&) = delete;

  /// The name under which SQLite has it.
  const std::string& vfs() const { return name_; }

  /// Writes and syncs until the power fails; negative: it stays.
  std::atomic<int> power_left = -1;
  bool power_failed() const { return power_left == 0; }
  /// Power again: what the cut has left of the files. No connection is open any more.
  void Restore(std::mt19937& random);

  /// SQLite's code that writes, or syncs, or both fail with; 0: they work.
  std::atomic<int> write_error = 0;
  std::atomic<int> sync_error = 0;
  std::atomic<int> open_error = 0;

  /// Syncs wait while it hangs.
  void Hang(bool hang);
  /// Until a sync waits.
  void WaitUntilItHangs();

  // ---- for the functions that SQLite calls
  struct Change {
    std::size_t offset = 0;
    std::vector<char> bytes;
    bool truncate = false;  // at `offset`
  };
  struct File {
    std::vector<char> now;
    std::vector<char> synced;
    std::vector<Change> pending;
    std::vector<std::unique_ptr<std::vector<char>>> shared;  // of all connections
    int handles = 0;
  };
  bool Spend();  ///< one operation; false: the power has failed
  void WaitWhileHanging();
  std::map<std::string, std::shared_ptr<File>> files;

 private:
  struct Vfs;
  const std::string name_;
  std::unique_ptr<Vfs> vfs_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool hangs_ = false;
  bool waits_ = false;
};

}  // namespace baudgate::audit
