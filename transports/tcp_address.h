// Reads "tcp://host:port" of a line's configuration; IPv6 addresses stand in brackets.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "gateway/base/result.h"

namespace baudgate {

struct TcpAddress {
  std::string host;  ///< name or address, without brackets
  std::uint16_t port = 0;
};

/// Whether the text claims to be such an address, right or wrong.
bool IsTcpPort(std::string_view port);

Result<TcpAddress> ParseTcpPort(std::string_view port);

}  // namespace baudgate
