// `DeviceMemory` stores what conversations need after a restart (Conversation::Memory), in one file
// of the state folder. Lines set memories on their threads; one thread writes the file. A memory
// belongs to the combination of line, device, protocol, address and profile: a change of one of
// these deletes the memory.
//
//   {"version": 1,
//    "devices": [{"line": "meters", "device": "incomer", "protocol": "set4tm", "address": "200",
//                 "profile": "set-4tm.03m", "memory": "serial 12345678"}]}
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/base/worker.h"

namespace baudgate::records {

class DeviceMemory {
 public:
  static constexpr Duration kAgain = 10s;

  using Tell = std::function<void(const std::string&)>;
  /// Reads `file`, which need not exist. `warn` is called with one line if the file cannot be read.
  /// `trouble` is called on the writing thread with the reason why the file cannot be written, and
  /// with an empty text when it can be written again. The destructor writes the changes that are
  /// left.
  DeviceMemory(std::filesystem::path file, const config::Config& config, Tell warn, Tell trouble);

  /// Returns the memory of a device; empty: the device has no memory. Devices are numbered through
  /// all lines, in the order of the configuration.
  std::string Of(std::uint32_t device) const;
  /// Applies a reload. `config` contains the devices by their numbers; a removed device has an
  /// empty name.
  void OnReload(const config::Config& config);
  /// Can be called on any thread; returns at once. A memory longer than kLongestMemory is ignored.
  void Set(std::uint32_t device, std::string memory);

  enum class Kept : std::uint8_t {
    yes,
    waits,
    no,
  };
  /// Returns whether all memories are on the disk. Can be called on any thread.
  Kept kept() const;

 private:
  std::vector<std::string> Read();
  void WriteChanges();
  std::string Text() const BAUDGATE_REQUIRES(mutex_);
  void Write(const std::string& text);

  const std::filesystem::path file_;
  const Tell warn_;
  const Tell trouble_;
  struct Key {
    std::string line;
    std::string device;
    std::string protocol;
    std::string address;
    std::string profile;

    bool operator==(const Key&) const = default;
  };
  static std::vector<Key> KeysOf(const config::Config& config);

  bool failing_ = false;  // for the writing thread only
  mutable Mutex mutex_;
  std::vector<Key> keys_ BAUDGATE_GUARDED_BY(mutex_);              // index: number of the device
  std::vector<std::string> memories_ BAUDGATE_GUARDED_BY(mutex_);  // parallel to keys_
  bool changed_ BAUDGATE_GUARDED_BY(mutex_) = false;
  Kept kept_ BAUDGATE_GUARDED_BY(mutex_) = Kept::yes;
  Worker worker_;
};

}  // namespace baudgate::records
