// Tests of `HostOf` and `FairPlaces`.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/fair_places.h"

#include <gtest/gtest.h>

namespace baudgate {
namespace {

TEST(HostOf, IsTheAddressOrTheNetworkOfAnIpv6Address) {
  EXPECT_EQ(HostOf("192.0.2.5:40312"), "192.0.2.5");
  EXPECT_EQ(HostOf("192.0.2.5"), "192.0.2.5");
  EXPECT_EQ(HostOf("[::ffff:192.0.2.5]:502"), "192.0.2.5");
  EXPECT_EQ(HostOf("[2001:db8:0:7:aaaa::1]:502"), "2001:db8:0:7::/64");
  EXPECT_EQ(HostOf("2001:db8:0:7::1"), "2001:db8:0:7::/64");
  EXPECT_EQ(HostOf("[fe80::1%eth0]:502"), "fe80::1%eth0");
  EXPECT_EQ(HostOf("user:root"), "user:root");
  EXPECT_EQ(HostOf("[no end"), "[no end");
  EXPECT_EQ(HostOf(""), "");
}

TEST(HostOf, ConnectionsOfAHostHaveOneNumber) {
  EXPECT_EQ(HostNumberOf("192.0.2.5:1"), HostNumberOf("192.0.2.5:2"));
  EXPECT_NE(HostNumberOf("192.0.2.5:1"), HostNumberOf("192.0.2.6:1"));
  EXPECT_EQ(HostNumberOf("[2001:db8::1]:1"), HostNumberOf("[2001:db8::2]:1"));
}

std::size_t TakeAll(FairPlaces& places, std::uint64_t host, std::size_t weight) {
  std::size_t taken = 0;
  while (places.Take(host, weight)) ++taken;
  return taken;
}

TEST(FairPlaces, EveryHostFindsAPlaceUntilVeryManyHostsHaveTheirs) {
  FairPlaces places(2048);
  EXPECT_EQ(TakeAll(places, 1, 3), 1536U);
  EXPECT_EQ(TakeAll(places, 2, 3), 384U);
  std::uint64_t host = 3;
  while (TakeAll(places, host, 3) > 0) ++host;
  EXPECT_EQ(host, 7U);
  EXPECT_FALSE(places.Take(host, 7)) << "all places are taken";
}

TEST(FairPlaces, AReturnedPlaceIsFreeForAllHosts) {
  FairPlaces places(4);
  EXPECT_EQ(TakeAll(places, 1, 1), 2U);
  EXPECT_EQ(TakeAll(places, 2, 1), 1U);
  places.Give(1);
  EXPECT_EQ(TakeAll(places, 3, 1), 1U);
  places.Give(9);  // a host without places changes nothing
  EXPECT_EQ(TakeAll(places, 3, 1), 0U);
}

}  // namespace
}  // namespace baudgate
