// `ToyMembers`: the members of a toy line, for tests of single parts of the poller.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/bus/devices/roster.h"
#include "gateway/bus/replies/late_replies.h"
#include "tests/support/virtual_line.h"

namespace baudgate::bus {

/// The times of a device are: reply 200 ms, gap 20 ms, ceiling 1 s, drain 50 ms (config::Timing).
/// The serial format is 9600 8N1.
struct ToyMembers {
  explicit ToyMembers(const std::string& port = "tcp://server:4001") { line.port = port; }

  config::Line line = ToyLine({ToyDevice("a", "A", {"1", "2"}), ToyDevice("b", "B", {"1"})});
  Roster roster{line, 0,
                [](const std::string&) -> const protocols::Protocol& { return ToyProtocol(); }};
  Device& a = roster.device(0);
  Device& b = roster.device(1);
};

inline config::Config ToyConfig() {
  config::Config config;
  config.lines.push_back(ToyMembers().line);
  return config;
}

/// Makes the request of an exchange. `named`: its reply contains the address of the device.
inline protocols::Request AskFor(std::string_view bytes, bool named = true) {
  protocols::Request request;
  request.bytes = ToBytes(bytes);
  if (named) request.expect.address = ToBytes(bytes.substr(1, 1));
  return request;
}

}  // namespace baudgate::bus
