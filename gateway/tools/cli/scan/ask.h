// `baudgate ask`: one telegram by hand, on a free port or through the running gateway in its turn;
// the answer as it came, and decoded.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"

namespace baudgate::tools {

struct AskOptions {
  std::string target;              ///< a port; or LINE or LINE.DEVICE of the running gateway
  std::string telegram;            ///< text (">1RF:XX") or hex
  std::string protocol;            ///< of a port; empty: the one whose telegrams begin like this
  std::string serial;              ///< of a port, "9600 7E1"; empty: the protocol's
  std::string profile;             ///< for names and units in the answer
  std::vector<std::string> set{};  ///< device options of a port, "key=value"
  bool rs485 = false;              ///< of a port: its driver switches the direction
  bool write = false;              ///< it may write
  bool json = false;
  std::string socket;  ///< of the gateway; empty: the default places
  std::size_t width = 0;
};

/// Exit code 0: something was answered; 1: nothing; 2: a wrong telegram, or one that may write and
/// was not allowed; 4: no port, no gateway.
int RunAsk(const AskOptions& options, const config::Catalog& catalog, std::ostream& out,
           std::ostream& err);

}  // namespace baudgate::tools
