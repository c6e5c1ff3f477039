// A Modbus RTU slave at the far end of a pty that says whatever its script tells it, on a thread of
// its own.
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

/// Address, PDU and CRC.
Bytes RtuFrame(std::uint8_t unit, View pdu);
/// The good reply to a read of registers, each of which holds `base` plus its address.
Bytes RegistersReply(View request, std::uint16_t base);
/// The address of the first register of a read.
std::uint16_t AddressOf(View request);

/// Bytes on the wire, so long after the request or the piece before.
struct Piece {
  Duration after{};
  Bytes bytes;
};

class ScriptedSlave {
 public:
  /// Called on the slave's thread with every whole request, whoever it is for.
  using Script = std::function<std::vector<Piece>(View request)>;

  /// `link`: where it can be opened, beside path(); empty: there only.
  ScriptedSlave(const std::string& link, Script script);
  ~ScriptedSlave();
  ScriptedSlave(const ScriptedSlave&) = delete;
  ScriptedSlave& operator=(const ScriptedSlave&) = delete;

  bool connected() const { return thread_.joinable(); }
  /// Where to open the other end.
  const std::string& path() const { return pty_->path(); }
  /// Whole requests in their order.
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
