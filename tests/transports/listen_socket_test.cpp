// Whether clients can reach a listening socket.
// SPDX-License-Identifier: Apache-2.0
#include "transports/listen_socket.h"

#include <gtest/gtest.h>
#include <netinet/in.h>

#include <asio/io_context.hpp>

namespace baudgate {
namespace {

using asio::ip::tcp;
/// Binds to an address that the machine does not have, as if it had left.
using FreeBind = asio::detail::socket_option::boolean<IPPROTO_IP, IP_FREEBIND>;

std::string TroubleAt(const char* address) {
  asio::io_context io;
  const tcp::endpoint at(asio::ip::make_address(address), 0);
  tcp::acceptor acceptor(io, at.protocol());
  if (at.address().is_v4()) acceptor.set_option(FreeBind(true));
  acceptor.bind(at);
  acceptor.listen();
  const Status has = HasAddressOf(acceptor);
  return has ? "" : has.error();
}

TEST(ListenSocket, NamesAnAddressThatHasLeftTheMachine) {
  for (const char* here : {"127.0.0.1", "127.0.0.7", "0.0.0.0", "::"}) {
    EXPECT_EQ(TroubleAt(here), "") << here;
  }
  EXPECT_EQ(TroubleAt("192.0.2.9"),
            "this machine does not have the address 192.0.2.9 now (ip addr lists what it has); "
            "clients come in again when it is back");
}

}  // namespace
}  // namespace baudgate
