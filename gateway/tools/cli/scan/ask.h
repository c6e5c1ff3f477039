// `baudgate ask`: sends one telegram to a free port or through the running gateway's queue, and
// prints the reply as bytes and decoded.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"

namespace baudgate::tools {

struct AskOptions {
  std::string target;    ///< a port; or LINE or LINE.DEVICE of the running gateway
  std::string telegram;  ///< text (">1RF:XX") or hex
  std::string protocol;  ///< for a port; empty: the protocol whose telegrams begin like this
  std::string serial;    ///< for a port, "9600 7E1"; empty: the protocol's default
  std::string profile;   ///< for names and units in the answer
  std::vector<std::string> set{};  ///< for a port: device options, "key=value"
  bool rs485 = false;              ///< for a port: its driver switches the direction
  bool write = false;              ///< the telegram is allowed to write
  bool json = false;
  std::string socket;  ///< of the gateway; empty: the default places
  std::size_t width = 0;
};

/// Exit codes: 0 a reply came; 1 no reply; 2 invalid telegram, or it may write without `write`; 4
/// no port or no gateway.
int RunAsk(const AskOptions& options, const config::Catalog& catalog, std::ostream& out,
           std::ostream& err);

}  // namespace baudgate::tools
