// A Modbus slave that is not the project's: libmodbus on a thread, on a tty or a TCP port.
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

/// libmodbus as slave or server. Register N holds 1000 + N (holding) and 2000 + N (input), 1000 of
/// each; coil N is on when 3 divides N, discrete input N when 5 does.
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

}  // namespace baudgate::system_test
