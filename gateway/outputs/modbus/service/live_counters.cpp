// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/live_counters.h"

namespace baudgate::modbus {

ModbusCounters LiveCounters::Snapshot() const {
  const auto read = [](const std::atomic<std::uint64_t>& counter) {
    return counter.load(std::memory_order_relaxed);
  };
  ModbusCounters copy;
  copy.clients = read(clients);
  copy.accepted = read(accepted);
  copy.refused = read(refused);
  copy.malformed = read(malformed);
  copy.idle = read(idle);
  copy.stalled = read(stalled);
  copy.accept_errors = read(accept_errors);
  copy.requests = read(requests);
  copy.exceptions = read(exceptions);
  return copy;
}

}  // namespace baudgate::modbus
