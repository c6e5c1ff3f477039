// What the clients of a Modbus server do, counted while it runs.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

#include "gateway/outputs/modbus/registers/register_contents.h"

namespace baudgate::modbus {

struct LiveCounters {
  std::atomic<std::uint64_t> clients = 0;
  std::atomic<std::uint64_t> accepted = 0;
  std::atomic<std::uint64_t> refused = 0;
  std::atomic<std::uint64_t> malformed = 0;
  std::atomic<std::uint64_t> idle = 0;
  std::atomic<std::uint64_t> stalled = 0;
  std::atomic<std::uint64_t> accept_errors = 0;
  std::atomic<std::uint64_t> requests = 0;
  std::atomic<std::uint64_t> exceptions = 0;

  ModbusCounters Snapshot() const;
  /// One thread writes, so no locked instruction is needed.
  static void Add(std::atomic<std::uint64_t>& counter) {
    counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
};

}  // namespace baudgate::modbus
