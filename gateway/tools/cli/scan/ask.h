// `baudgate ask`: sends one telegram, to a free port or through the gateway, and prints the reply.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"

namespace baudgate::tools {

struct AskOptions {
  std::string target;    ///< a port, or LINE or LINE.DEVICE of the running gateway
  std::string telegram;  ///< the telegram as text (">1RF:XX") or hex
  /// For a port; empty: by the first character of the telegram.
  std::string protocol;
  std::string serial;  ///< for a port, "9600 7E1"; empty: the protocol's default
  std::string profile;
  std::vector<std::string> set{};  ///< for a port: "key=value"
  bool rs485 = false;              ///< for a port
  bool write = false;
  bool json = false;
  std::string socket;  ///< empty: the only gateway in the default places
  std::size_t width = 0;
};

/// Exit codes: 0 a reply came; 1 none; 2 invalid telegram, or it could write; 4 no such port or no
/// gateway.
int RunAsk(const AskOptions& options, const config::Catalog& catalog, std::ostream& out,
           std::ostream& err);

}  // namespace baudgate::tools
