// The log line about a client that was turned away or closed; called by listener.cpp and
// client_session.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <string_view>

#include "gateway/base/log.h"

namespace baudgate::modbus {

/// "10.0.0.7:40112", "refused", and why. Clients at one address are repeats of each other: their
/// ports differ every time.
inline void WarnOfClient(std::string_view peer, std::string_view what, std::string_view why) {
  const std::string_view address = peer.substr(0, peer.rfind(':'));
  log::WarnFolded(fmt::format("modbus: client {} {}", address, what), "modbus: client {} {}: {}",
                  peer, what, why);
}

}  // namespace baudgate::modbus
