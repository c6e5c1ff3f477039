// Raw TCP to a serial server as a transport: bytes come from and go to the server's serial port.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "transports/host_names.h"
#include "transports/transport.h"

namespace baudgate {

/// `port` is "tcp://host:port"; one that cannot be read fails at every Open. `listener` outlives
/// the transport. A server whose network path died silently is noticed within about 25 s; one that
/// answers TCP but lost its serial side is for the line to notice: Close and Open again.
/// `names` outlives the transport.
std::unique_ptr<Transport> MakeTcpClient(std::string port, const config::SerialSettings& serial,
                                         asio::io_context& io, TransportListener& listener,
                                         HostNames& names = HostNames::OfProcess());

}  // namespace baudgate
