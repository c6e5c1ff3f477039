// Key hashes against those that were computed apart from this code.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "gateway/outputs/dds/fast/types.h"

namespace baudgate::dds {
namespace {

TEST(KeyHash, IsWhatEveryVendorComputes) {
  PointSample point;
  point.gateway = "sub-7", point.device = "feeder-1", point.point = "current_l1";
  EXPECT_EQ(ToHex(HashKey(point)), "DE 56 C3 97 F6 81 9A 85 FD B6 E3 03 A4 F1 59 7F");
  point.value = 7;  // no part of the key
  EXPECT_EQ(ToHex(HashKey(point)), "DE 56 C3 97 F6 81 9A 85 FD B6 E3 03 A4 F1 59 7F");
  DeviceSample device;
  device.gateway = "sub-7", device.device = "feeder-1";
  EXPECT_EQ(ToHex(HashKey(device)), "85 15 01 FE B4 1F 4A E8 6E 90 8F F1 06 94 FA 6B");
  GatewaySample gateway;
  gateway.gateway = "sub-7", gateway.start_time_ns = 7;
  EXPECT_EQ(ToHex(HashKey(gateway)), "2C C4 20 7D 86 5D 85 C9 56 B2 53 AC 57 6B 24 86");
  RequestSample request;
  request.gateway = "sub-7", request.client = "plc-1", request.seq = 7;
  EXPECT_EQ(ToHex(HashKey(request)), "95 F9 18 16 00 1F 3F F8 E6 FC 89 D5 9D 2B 83 E7");
  ReplySample reply;
  reply.gateway = "sub-7", reply.client = "plc-1";
  EXPECT_EQ(HashKey(reply), HashKey(request));
}

}  // namespace
}  // namespace baudgate::dds
