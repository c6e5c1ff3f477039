// `LibmodbusSlave` is a Modbus slave or server made with libmodbus, in a thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>

struct _modbus;
struct _modbus_mapping_t;

namespace baudgate::system_test {

/// Holding register N contains 1000 + N, input register N contains 2000 + N. Coil N is on if 3
/// divides N; discrete input N is on if 5 divides N.
class LibmodbusSlave {
 public:
  static constexpr int kSize = 1000;

  static std::unique_ptr<LibmodbusSlave> OnTty(const std::string& tty, int unit);
  /// Answers every unit id, one client at a time.
  static std::unique_ptr<LibmodbusSlave> OnTcp(std::uint16_t port);
  ~LibmodbusSlave();
  LibmodbusSlave(const LibmodbusSlave&) = delete;
  LibmodbusSlave& operator=(const LibmodbusSlave&) = delete;

  bool connected() const { return connected_; }
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

}  // namespace baudgate::system_test
