// Which transport a line gets.
// SPDX-License-Identifier: Apache-2.0
#include "transports/transport.h"

#include <gtest/gtest.h>

#include "tests/transports/far_end.h"

namespace baudgate {
namespace {

TEST(MakeTransport, FormOfThePortDecides) {
  asio::io_context io;
  test::Recorder listener;
  config::Line line;
  line.port = "/dev/ttyUSB0";
  EXPECT_EQ(MakeTransport(line, io, listener)->Describe(), "serial /dev/ttyUSB0 9600 8N1");
  line.port = "tcp://[::1]:4001";
  EXPECT_EQ(MakeTransport(line, io, listener)->Describe(), "tcp://[::1]:4001");
}

}  // namespace
}  // namespace baudgate
