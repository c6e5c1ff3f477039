// Modbus slaves for tests, each on a thread of its own: one of libmodbus that answers as it should,
// on a tty or a TCP port, and one at the far end of a pty that says whatever its script tells it.
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
#include "gateway/simulate/pty.h"

struct _modbus;
struct _modbus_mapping_t;

namespace baudgate::system_test {

/// libmodbus as slave or server. Register N holds 1000 + N (holding) and 2000 + N (input), 1000 of
/// each; coil N is on when 3 divides N, discrete input N when 5 does.
class LibmodbusSlave {
 public:
  static constexpr int kSize = 1000;

  static std::unique_ptr<LibmodbusSlave> OnTty(const std::string& tty, int unit);
  /// Of every unit id, one client at a time.
  static std::unique_ptr<LibmodbusSlave> OnTcp(std::uint16_t port);
  ~LibmodbusSlave();
  LibmodbusSlave(const LibmodbusSlave&) = delete;
  LibmodbusSlave& operator=(const LibmodbusSlave&) = delete;

  bool connected() const { return connected_; }
  /// That the latest request was for.
  int last_unit() const { return last_unit_; }

 private:
  LibmodbusSlave(_modbus* context, bool tcp);
  void Run();
  bool HasClient();

  _modbus* context_;
  _modbus_mapping_t* memory_;
  bool tcp_;
  int listening_ = -1;
  int client_ = -1;
  bool connected_ = false;
  std::atomic<int> last_unit_ = -1;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

/// Address, PDU and CRC.
Bytes RtuFrame(std::uint8_t unit, View pdu);
/// The good reply to a read of registers, each of which holds `base` plus its address.
Bytes RegistersReply(View request, std::uint16_t base);
/// Of a read: the first register's address.
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

  ScriptedSlave(const std::string& link, Script script);
  ~ScriptedSlave();
  ScriptedSlave(const ScriptedSlave&) = delete;
  ScriptedSlave& operator=(const ScriptedSlave&) = delete;

  bool connected() const { return thread_.joinable(); }
  /// Whole requests in their order.
  std::vector<Bytes> heard() const;

 private:
  void Run();
  void Handle(const Bytes& request);

  std::unique_ptr<Pty> pty_;
  Script script_;
  mutable std::mutex mutex_;
  std::vector<Bytes> heard_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace baudgate::system_test
