// SPDX-License-Identifier: Apache-2.0
#include "transports/transport.h"

#include "transports/serial_port.h"
#include "transports/tcp_client.h"

namespace baudgate::transports {

std::unique_ptr<Transport> MakeTransport(const config::Line& line, asio::io_context& io,
                                         TransportListener& listener) {
  if (config::IsNetworkPort(line.port)) {
    return MakeTcpClient(line.port, line.serial, line.tls, io, listener);
  }
  return MakeSerialPort(line.port, line.serial, io, listener);
}

}  // namespace baudgate::transports
