// `FaultyDisk`: a disk for SQLite, in memory. It can be full, fail, hang, or lose its power. A
// power cut keeps all synced data; an unsynced write is kept, lost, or torn.
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

inline constexpr const char* kEventsFile = "/events.db";

class FaultyDisk {
 public:
  FaultyDisk();
  ~FaultyDisk();
  FaultyDisk(const FaultyDisk&) = delete;
  FaultyDisk& operator=(const FaultyDisk&) = delete;

  const std::string& vfs() const { return name_; }

  /// Number of writes and syncs until the power fails; negative: the power does not fail.
  std::atomic<int> power_left = -1;
  bool power_failed() const { return power_left == 0; }
  /// Restores the power. The files are as the power cut has left them. No connection must be open.
  void Restore(std::mt19937& random);

  /// SQLite error codes that writes, syncs or opens return; 0: no error.
  std::atomic<int> write_error = 0;
  std::atomic<int> sync_error = 0;
  std::atomic<int> open_error = 0;

  void Hang(bool hang);
  void WaitUntilItHangs();

  struct Change {
    std::size_t offset = 0;
    std::vector<char> bytes;
    bool truncate = false;
  };
  struct File {
    std::vector<char> now;
    std::vector<char> synced;
    std::vector<Change> pending;
    std::vector<std::unique_ptr<std::vector<char>>> shared;
    int handles = 0;
  };
  bool Spend();
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
