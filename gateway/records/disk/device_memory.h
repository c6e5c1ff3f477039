// What conversations want to know after a restart (Conversation::Memory), in one file of the state
// folder. Lines put it in from their threads; one thread here writes. A memory belongs to line,
// device, protocol, address and profile: a change of any of these forgets it.
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
  /// A failed write is tried again after this time.
  static constexpr Duration kAgain = 10s;

  using Tell = std::function<void(const std::string&)>;
  /// Reads `file`, which need not be there. `warn` gets one line when it cannot be read; `trouble`
  /// why it cannot be written by now, or an empty text, from the writing thread. Its end writes
  /// what has changed.
  DeviceMemory(std::filesystem::path file, const config::Config& config, Tell warn, Tell trouble);

  /// Devices are numbered through all lines, in the order of the file. Empty: nothing is known.
  std::string Of(std::uint32_t device) const;
  /// A reload: devices by their numbers; one without a name is gone.
  void OnReload(const config::Config& config);
  /// From any thread; returns at once.
  void Set(std::uint32_t device, std::string memory);

  enum class Kept : std::uint8_t {
    yes,
    waits,  ///< for the writing thread
    no,     ///< it could not be written
  };
  /// Whether all that was set is on the disk. From any thread.
  Kept kept() const;

 private:
  std::vector<std::string> Read();
  void WriteChanges();
  std::string Text() const BAUDGATE_REQUIRES(mutex_);
  void Write(const std::string& text);

  const std::filesystem::path file_;
  const Tell warn_;
  const Tell trouble_;
  /// Whose a memory is.
  struct Key {
    std::string line;
    std::string device;
    std::string protocol;
    std::string address;
    std::string profile;

    bool operator==(const Key&) const = default;
  };
  static std::vector<Key> KeysOf(const config::Config& config);

  bool failing_ = false;  // of the writing thread
  mutable Mutex mutex_;
  std::vector<Key> keys_ BAUDGATE_GUARDED_BY(mutex_);              // by device
  std::vector<std::string> memories_ BAUDGATE_GUARDED_BY(mutex_);  // as keys_
  bool changed_ BAUDGATE_GUARDED_BY(mutex_) = false;
  Kept kept_ BAUDGATE_GUARDED_BY(mutex_) = Kept::yes;
  Worker worker_;
};

}  // namespace baudgate::records
