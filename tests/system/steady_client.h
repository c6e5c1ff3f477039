// `SteadyClient` sends requests all the time on one connection and counts failures.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <thread>
#include <utility>

#include "tests/system/child.h"
#include "tests/system/modbus_client.h"

namespace baudgate::system_test {

class SteadyClient {
 public:
  /// `ask` returns whether the answer was right. It is called on the client's thread.
  SteadyClient(std::uint16_t port, std::function<bool(ModbusClient&)> ask)
      : thread_([this, port, ask = std::move(ask)] { Run(port, ask); }) {}
  ~SteadyClient() { Stop(); }
  SteadyClient(const SteadyClient&) = delete;
  SteadyClient& operator=(const SteadyClient&) = delete;

  int Stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    return failed_;
  }
  int asked() const { return asked_; }
  bool GoesOn() const {
    return Eventually([this, until = asked() + 10] { return asked() > until; });
  }

 private:
  void Run(std::uint16_t port, const std::function<bool(ModbusClient&)>& ask) {
    ModbusClient client(port);
    while (!stop_) {
      if (!ask(client)) ++failed_;
      ++asked_;
      std::this_thread::sleep_for(2ms);
    }
  }
  std::atomic<bool> stop_ = false;
  std::atomic<int> failed_ = 0;
  std::atomic<int> asked_ = 0;
  std::thread thread_;
};

}  // namespace baudgate::system_test
