// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/outputs/dds/fast/own_network.h"

namespace baudgate::dds {
namespace {

TEST(InterfaceWatch, TellsWhatTheLibraryCannotFollow) {
  const OwnAddresses begin = {{"127.0.0.1", 1}, {"10.0.0.5", 2}, {"10.1.0.5", 3}, {"10.3.0.5", {}}};
  struct Row {
    std::vector<std::string> interfaces;
    OwnAddresses now;
    const char* why;
  };
  const Row rows[] = {
      {{"10.0.0.5"}, begin, ""},
      {{"10.0.0.5"}, {{"127.0.0.1", 1}}, ""},  // gone, and there is no other
      {{"127.0.0.1", "10.0.0.5"},
       {{"127.0.0.1", 1}},
       "this machine no longer has the address 10.0.0.5"},
      {{"127.0.0.1", "10.0.0.5"}, {{"127.0.0.1", 1}, {"10.0.0.5", {}}}, ""},  // down
      {{"127.0.0.7", "10.0.0.5"},
       {{"127.0.0.1", 1}},
       "this machine no longer has the address 10.0.0.5"},
      {{"127.0.0.1", "10.2.0.5"}, begin, ""},  // it was not there before
      {{"10.1.0.5", "10.0.0.5"}, {{"127.0.0.1", 1}}, ""},
      {{}, {{"127.0.0.1", 1}}, ""},
      {{"10.0.0.5"}, {{"10.0.0.5", 7}}, "the interface of 10.0.0.5 was made anew"},
      {{"10.0.0.5"}, {{"10.0.0.5", 2}, {"10.1.0.5", 9}}, ""},  // that of another address
      {{"10.0.0.5"}, {{"10.0.0.5", 2}, {"10.2.0.5", 9}}, ""},
      {{"127.0.0.1", "10.1.0.5"}, {{"10.1.0.5", 9}}, "the interface of 10.1.0.5 was made anew"},
      {{"10.0.0.5"}, {{"10.0.0.5", {}}}, ""},  // down
      {{"10.3.0.5"}, {{"10.3.0.5", 4}}, "the interface of 10.3.0.5 is up now"},
      {{"10.3.0.5"}, {{"10.3.0.5", {}}}, ""},
      {{}, {{"10.2.0.5", {}}}, ""},
      {{}, {{"10.2.0.5", 9}}, "this machine has a new address, 10.2.0.5"},
      {{"0.0.0.0"}, {{"10.0.0.5", 9}}, "the interface of 10.0.0.5 was made anew"},
      {{}, {}, ""},
  };
  for (const Row& row : rows) {
    EXPECT_EQ(InterfaceWatch(row.interfaces, begin).Look(row.now).value_or(""), row.why);
  }
}

TEST(InterfaceWatch, FindsTheLoopback) {
  const OwnAddresses own = FindOwnAddresses();
  EXPECT_TRUE(own.at("127.0.0.1"));
  EXPECT_TRUE(IsOwn(own, "127.0.0.7"));
  EXPECT_FALSE(IsOwn(own, "192.0.2.1"));
  EXPECT_FALSE(IsOwn(own, "localhost"));
}

TEST(InterfaceWatch, SaysWhyNothingIsSent) {
  const OwnAddresses own = {{"127.0.0.1", 1}, {"10.0.0.5", 2}, {"10.3.0.5", {}}};
  EXPECT_EQ(WhyUnused(own, "10.0.0.5"), std::nullopt);
  EXPECT_EQ(WhyUnused(own, "127.0.0.7"), std::nullopt);
  EXPECT_EQ(WhyUnused(own, "10.3.0.5"), "its interface is down or unplugged");
  EXPECT_EQ(WhyUnused(own, "10.4.0.5"), "no interface of this machine has it now");
}

}  // namespace
}  // namespace baudgate::dds
