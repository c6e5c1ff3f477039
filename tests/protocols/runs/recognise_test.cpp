// What protocols recognise that is nearly theirs: the hook Protocol::recognise of those on real
// lines.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "tests/config/shipped.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

struct Words {
  std::string line;
  std::string request;
  std::string heard;
  std::string cause;  ///< empty: nothing is recognised
};

TEST(Recognise, WhatIsNearlyTheirs) {
  const auto set4tm = [](const std::string& hex) {
    Bytes bytes = ParseHex(hex).value();
    return std::string(AsText(bytes));
  };
  const Words rows[] = {
      {"Dcon115200", "$01MD2\r", "!01MV110B7\r", ""},
      {"Dcon115200", "$01MD2\r", "!02MV110B8\r", "module 02 answers where 01 was asked"},
      {"Dcon115200", "$01MD2\r", "$07MD8\r",
       "another master speaks on the line: it has sent '$07MD8'"},
      {"Dcon9600", "#0184\r", ">+100.23+034.05\r", "its replies carry no checksum"},
      {"Dcon9600", "#0184\r", ">+100.23+034.05FF\r", ""},
      {"Dcon9600", "#0184\r", ">01+100.23+034.0543\r", "its replies with '>' carry its address"},
      {"Dcon9600", "#0184\r", ">02+100.23+034.0544\r", ""},
      {"Spa9600", ">1RI1:17\r", "<7D:0.52:56\r\n", "slave 7 answers where slave 1 was asked"},
      {"Spa9600", ">1RI1:17\r", "<7D:0.52:67\r\n", ""},
      {"Spa9600", ">1RI1:17\r", "<1D:0.52:5A\r\n", "its checksums count the line feed in front"},
      {"Spa9600", ">1RI1:17\r", "<1D:0.52:\r\n", "its replies carry no checksum"},
      {"Spa9600", ">1RI1:17\r", "<D:0.52:50\r\n", "its replies carry no slave number"},
      {"Spa9600", ">1RI1:17\r", "<1D:73\r\n",
       "its replies have a right check value and another form ('<1D:73')"},
      {"Spa9600", ">1RI1:17\r", "<1D:74\r\n", ""},
      {"Spa9600", ">1RI1:17\r", ">9RF:XX\r",
       "another master speaks on the line: it has asked slave 9"},
      {"Set4tm9600", set4tm("C8081B001177BB"), set4tm("05008066431234"), ""},
      {"Set4tm9600", set4tm("C8081B001177BB"), set4tm("FD0F0124"),
       "the GSM communicator (253) says that the meter does not answer"},
  };
  for (const Words& row : rows) {
    const auto& setup = RealLine(row.line);
    const config::Device device = LineOf(setup).devices[0];
    const auto found = setup.protocol->recognise(ToBytes(row.request), ToBytes(row.heard),
                                                 ParseOptions(*setup.protocol, device.options));
    EXPECT_EQ(found ? found->cause : std::string(), row.cause) << row.heard;
    EXPECT_TRUE(!found || !found->remedy.empty()) << row.heard;
  }
}

TEST(Recognise, AChecksumThatIsNotConfigured) {
  const auto& setup = RealLine("Dcon9600");
  config::Device device = LineOf(setup).devices[0];
  device.options.Set("checksum", false);
  const auto found = setup.protocol->recognise(ToBytes("$01M\r"), ToBytes("!01MV110B7\r"),
                                               ParseOptions(*setup.protocol, device.options));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->cause + ": " + found->remedy,
            "its replies carry a checksum: set checksum: true in the configuration, or the other "
            "way round "
            "in the module");
}

}  // namespace
}  // namespace baudgate
