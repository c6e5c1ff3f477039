// `baudgate ask`: sends one telegram, to a free port or through the queue of the running gateway,
// and prints the reply as bytes and decoded.
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
  /// The protocol of a port; empty: the protocol whose telegrams begin with the same character.
  std::string protocol;
  std::string serial;  ///< if `target` is a port: "9600 7E1"; empty: the protocol's default
  std::string profile;
  std::vector<std::string> set{};  ///< if `target` is a port: device options, "key=value"
  bool rs485 = false;  ///< if `target` is a port: its driver switches the RS-485 direction
  bool write = false;
  bool json = false;
  /// Path of the control socket; empty: the only running gateway is used.
  std::string socket;
  std::size_t width = 0;
};

/// Exit codes: 0 a reply came; 1 no reply came; 2 a value is invalid, or the telegram may write and
/// `write` is false; 4 nothing was sent: no such port, or no gateway.
int RunAsk(const AskOptions& options, const config::Catalog& catalog, std::ostream& out,
           std::ostream& err);

}  // namespace baudgate::tools
