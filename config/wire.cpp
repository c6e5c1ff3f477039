// SPDX-License-Identifier: Apache-2.0
#include "config/wire.h"

#include "config/option_table.h"

namespace baudgate::config {

Bytes ProbeOf(const Protocol& protocol, const std::string& address) {
  Line line;
  line.protocol = std::string(protocol.name);
  line.options = DefaultOptions(protocol);
  Device device;
  device.protocol = line.protocol;
  device.address = address;
  device.options = line.options;
  const auto conversation = protocol.make_bus(line)->MakeConversation(device);
  const auto probe = conversation->Ask({Task::Kind::probe, 0, kNoPoint, {}}, Instant{});
  return probe ? probe->bytes : Bytes();
}

}  // namespace baudgate::config
