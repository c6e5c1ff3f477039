// `ScriptedSlave` is a Modbus RTU slave on a pty that answers as its script prescribes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/tools/simulate/pty.h"

namespace baudgate {

Bytes RtuFrame(std::uint8_t unit, View pdu);
/// Returns the good reply to a read of registers. Each register contains `base` plus its address.
Bytes RegistersReply(View request, std::uint16_t base);
std::uint16_t AddressOf(View request);

struct Piece {
  Duration after{};
  Bytes bytes;
};

class ScriptedSlave {
 public:
  /// Called on the slave's thread with every complete request, for any unit.
  using Script = std::function<std::vector<Piece>(View request)>;

  /// `link` is a further path at which the pty can be opened; empty: no further path.
  ScriptedSlave(const std::string& link, Script script);
  ~ScriptedSlave();
  ScriptedSlave(const ScriptedSlave&) = delete;
  ScriptedSlave& operator=(const ScriptedSlave&) = delete;

  bool connected() const { return thread_.joinable(); }
  const std::string& path() const { return pty_->path(); }
  std::vector<Bytes> heard() const;

 private:
  void Run();
  void Handle(const Bytes& request);

  std::unique_ptr<tools::Pty> pty_;
  Script script_;
  mutable std::mutex mutex_;
  std::vector<Bytes> heard_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace baudgate
