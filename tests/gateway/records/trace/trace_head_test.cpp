// The comments on top of a trace, there and back.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/records/trace/trace_text.h"

namespace baudgate {
namespace {

using ::testing::ElementsAre;

config::Line ALine() {
  config::Line line;
  line.name = "bay-1";
  line.port = "/dev/ttyUSB0";
  line.protocol = "spabus";
  config::Device& device = line.devices.emplace_back();
  device.name = "feeder-1";
  device.protocol = "spabus";
  device.profile = "spaj140c";
  device.options.Set("password", std::string("SECRET"));
  device.options.Set("checksum", false);
  device.options.SetWritten("checksum", "off");
  device.options.SetWritten("asks", "all, and\nmore");
  return line;
}

TEST(TraceHead, NamesTheDevicesAndTheirOptions) {
  EXPECT_THAT(
      TraceHead(ALine()),
      ElementsAre("# line bay-1, port /dev/ttyUSB0 9600 8N1, protocol spabus",
                  "# device feeder-1, protocol spabus, profile spaj140c, set checksum=off"));
}

TEST(TraceHead, IsReadBack) {
  EXPECT_EQ(ReadTracedDevice(TraceHead(ALine())[1]),
            (TracedDevice{"feeder-1", "spabus", "spaj140c", {"checksum=off"}}));
  for (const char* other : {"", "# line bay-1, protocol spabus", "# device feeder-1",
                            "# device , protocol spabus", "12:00:00.000000 a # device x"}) {
    EXPECT_EQ(ReadTracedDevice(other), std::nullopt) << other;
  }
}

}  // namespace
}  // namespace baudgate
