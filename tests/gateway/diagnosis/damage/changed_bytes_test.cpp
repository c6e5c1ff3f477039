// What a damaged try lacks beside the good reply to its repeat.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/changed_bytes.h"

#include <gtest/gtest.h>

#include <string>

#include "gateway/base/text.h"

namespace baudgate {
namespace {

TEST(ChangedBytes, OneOrTwoBytesAreLostInside) {
  const struct {
    std::string heard;
    std::string reply;
    bool lacks;
  } rows[] = {
      {">+0.34\r", ">+02.34\r", true},
      {">+0.4\r", ">+02.34\r", true},
      {">+0.4\r\n", ">+02.34\r", true},                          // line ends do not count
      {">+02.34\r", ">+02.34\r", false},                         // nothing is lost
      {">+.4\r", ">+02.34\r", false},                            // three are too many
      {">+0.35\r", ">+02.34\r", true},                           // the value has moved
      {">+9.51\r", ">+02.34\r", false},                          // another text
      {":0103043666F0\r\n", ":010304436643660866F0\r\n", true},  // a burst of them
      {":0103043666F0", ":010304436643660866F0\r\n", false},     // it may break off
      {"<+0.34\r", ">+02.34\r", false},                          // another first byte
      {">+4\r", ">+04\r", false},                                // too short to prove anything
      {"", ">+02.34\r", false},
  };
  for (const auto& row : rows) {
    EXPECT_EQ(LacksSome(ToBytes(row.heard), ToBytes(row.reply)), row.lacks) << row.heard;
  }
}

}  // namespace
}  // namespace baudgate
