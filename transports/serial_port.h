// A tty or pty as a transport: bytes come from and go to the device file of the configuration.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "transports/transport.h"

namespace baudgate {

/// `listener` outlives the transport.
std::unique_ptr<Transport> MakeSerialPort(std::string port, const config::SerialSettings& serial,
                                          asio::io_context& io, TransportListener& listener);

}  // namespace baudgate
