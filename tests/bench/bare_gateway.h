// Programs whose speed is the limit for the route benchmarks: a slave that answers at once, and a
// minimal master and gateway.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "gateway/base/bytes.h"
#include "tests/support/rtu_slave.h"

namespace baudgate::bench {

/// Answers a read of one register with 0x09C4 at every address.
std::vector<Piece> InstantAnswer(View request);

Bytes ReadFrame(std::uint16_t address);
Bytes ReadAdu(std::uint16_t transaction, std::uint16_t address);

int OpenRaw(const std::string& path);
bool ReadWhole(int descriptor, std::uint8_t* to, std::size_t count);

/// A minimal gateway: one epoll loop, Modbus TCP in, RTU out, one request at a time, no checks.
class BareGateway {
 public:
  explicit BareGateway(const std::string& tty);
  ~BareGateway();

  std::uint16_t port() const { return port_; }

 private:
  void Run();

  int tty_ = -1;
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace baudgate::bench
