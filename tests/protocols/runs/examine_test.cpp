// What came in place of a reply, on every protocol: the symptom, and the words of the protocol.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/line/examine.h"

#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "tests/config/shipped.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

using enum Symptom;

struct Came {
  Duration after;
  std::string hex;
};

struct Row {
  std::string line;  ///< as in RealLines
  std::string request;
  std::vector<Came> came;
  Outcome outcome;
  Symptom symptom;
  std::string cause{};
};

Bytes FromHex(const std::string& hex) { return ParseHex(hex).value(); }

Finding Look(const Row& row) {
  const Setup& setup = row.line == "ModbusTcp" ? TcpLine() : RealLine(row.line);
  const config::Device device = LineOf(setup).devices[0];
  const ParsedOptions options = ParseOptions(*setup.protocol, device.options);
  const Bytes request = FromHex(row.request);
  const Expectation expect = setup.protocol->expect(request, options);
  const std::vector<ForeignRule> foreign = testing::Shipped().ForeignRules();
  Bytes heard;
  std::vector<Arrival> arrivals;
  for (const Came& came : row.came) {
    arrivals.push_back({heard.size(), came.after});
    Append(heard, FromHex(came.hex));
  }
  return Examine({.protocol = setup.protocol,
                  .options = &options,
                  .request = request,
                  .expect = &expect,
                  .outcome = row.outcome,
                  .heard = heard,
                  .arrivals = arrivals,
                  .reply = 100ms,
                  .gap = 50ms,
                  .connection = setup.protocol->tcp,
                  .foreign = foreign});
}

const std::string kRtu = "010300000001840A";
const std::string kAscii = "3A30313033303030303030303146420D0A";
const std::string kRtuReply = "010302004BF873";
const std::string kTcp = "000500000006010300000001";

TEST(Examine, SaysWhatCame) {
  const Row rows[] = {
      {"ModbusRtu19200", kRtu, {}, Outcome::no_reply, silence},
      {"ModbusRtu19200", kRtu, {{20ms, kRtuReply}}, Outcome::ok, clean},
      {"ModbusRtu19200",
       kRtu,
       {{2ms, "00000001840A"}, {80ms, kRtuReply}},
       Outcome::corrupt,
       late_echo,
       "cut"},
      {"ModbusAscii9600",
       kAscii,
       {{20ms, "3031303330323030344241460D0A"}},
       Outcome::partial,
       head_lost},
      {"ModbusAscii9600",
       kAscii,
       {{20ms, "3A303130333032303034424146"}},
       Outcome::partial,
       tail_lost,
       "its line end"},
      {"ModbusRtu19200", kRtu, {{20ms, kRtuReply}, {30ms, kRtuReply}}, Outcome::ok, copies},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, "A1B2C3D4E5" + kRtuReply}},
       Outcome::ok,
       noise_before,
       "A1 B2 C3 D4 E5 ..."},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, kRtuReply + "A1B2C3D4E5"}},
       Outcome::ok,
       noise_behind,
       "... A1 B2 C3 D4 E5"},
      {"ModbusRtu19200", kRtu, {{20ms, "0000" + kRtuReply + "FF"}}, Outcome::ok, clean},
      {"ModbusTcp",
       kTcp,
       {{20ms, "000500000005010302004BF873"}},
       Outcome::ok,
       noise_behind,
       "... F8 73"},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, kRtuReply + ToHex(ToBytes("alive"))}},
       Outcome::ok,
       text_beside,
       "'alive'"},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, "1002" + kRtuReply + "1003"}},
       Outcome::ok,
       noise_before,
       "10 02 ... 10 03"},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, kRtuReply + "010302004CB9B1"}},
       Outcome::unexpected,
       two_replies},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, "01031302004BF81373"}},
       Outcome::corrupt,
       other_setting,
       "XON and XOFF characters (11, 13) are mixed into its replies"},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, "0103024BF873"}},
       Outcome::corrupt,
       other_setting,
       "bytes 00 are missing inside its replies"},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, "010302B844"}},
       Outcome::partial,
       other_setting,
       "bytes 00 are missing inside its replies"},
      {"ModbusRtu19200",
       "0103000000044409",
       {{20ms, "01030803E903F703FE1B48"}},
       Outcome::partial,
       other_setting,
       "bytes 11 and 13 are missing inside its replies"},
      {"ModbusRtu19200",
       "0103000000044409",
       {{20ms, "01030803EA03F103F803FF"}},
       Outcome::partial,
       tail_lost,
       "its check value"},
      {"ModbusRtu19200",
       "0103000000044409",
       {{20ms, "01030803EA03F103F803FF22"}},
       Outcome::partial,
       end_lost},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, "010302A131"}},
       Outcome::corrupt,
       other_reply,
       "its replies have a right check value, and a wrong function or count"},
      {"ModbusRtu19200",
       "0103012C002885E1",
       {{20ms, "0183020000"}},
       Outcome::corrupt,
       other_setting,
       "it refuses (exception 02, illegal data address), with a wrong check value"},
      {"ModbusAscii9600",
       ToHex(ToBytes(":010300000001FB\r\n")),
       {{20ms, ToHex(ToBytes(":018302\r\n"))}},
       Outcome::corrupt,
       other_setting,
       "it refuses (exception 02, illegal data address), without a check value"},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, "010302000A7981"}},
       Outcome::corrupt,
       other_setting,
       "a 0A comes where a 0D belongs"},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, "FEFCFDFFB4078C"}},
       Outcome::corrupt,
       other_setting,
       "its replies are right once every bit is inverted"},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, "01010303020200004B4BF8F87373"}},
       Outcome::corrupt,
       other_setting,
       "each byte of its replies comes twice"},
      {"Dcon9600",
       ToHex(ToBytes("$01MD2\r")),
       {{20ms, ToHex(ToBytes("!!0011MMVV111100BB77\r\r"))}},
       Outcome::unexpected,
       other_setting,
       "each byte of its replies comes twice"},
      {"ModbusRtu19200",
       "02030000000AC5FE",
       {{20ms, "03141100110311061109110C110F111211151118111BCC60"}},
       Outcome::partial,
       head_lost},
      {"ModbusRtu19200",
       "02030000000AC5FE",
       {{20ms, "020314000306090C0F1215181BCC60"}},
       Outcome::partial,
       other_setting,
       "bytes 11 are missing inside its replies"},
      {"ModbusAscii9600",
       ToHex(ToBytes(":010300000001FB\r\n")),
       {{20ms, "3A300030333000303000424100000A"}},
       Outcome::partial,
       other_setting,
       "only characters of one parity come, and 00 in place of the others"},
      // Each character with an even number of ones came as 00.
      {"ModbusRtu19200",
       "0B030000000AC567",
       {{20ms, "0B00003B003BCD3B003B003B003BE93B003BF73BFE6213"}},
       Outcome::unexpected,
       other_setting,
       "only characters of one parity come, and 00 in place of the others"},
      // Nobody drives the line.
      {"ModbusRtu19200", "0B030000000AC567", {{20ms, "0000FFFF0000FFFF000000FF00"}}, {}, zeros, ""},
      {"Dcon9600",
       ToHex(ToBytes("#0184\r")),
       {{20ms, "040300000002C45E"}},
       Outcome::partial,
       other_master,
       "messages of Modbus RTU come (slave 4)"},
      {"Dcon9600",
       ToHex(ToBytes("#0184\r")),
       {{20ms, ToHex(ToBytes(">+04.50+02.5143\r"))}},
       Outcome::corrupt,
       other_setting,
       "its checksum leaves out the '>'"},
      {"ModbusRtu19200", kRtu, {{20ms, "FFFB01FFFD03"}}, Outcome::corrupt, bytes_lost},
      // As long as a refusal.
      {"ModbusRtu19200", kRtu, {{20ms, "01034BF873"}}, Outcome::partial, bytes_lost},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, kRtuReply}, {60ms, ToHex(ToBytes("#02\r"))}},
       Outcome::ok,
       master_beside,
       "requests of DCON come ('#02')"},
      {"Spa9600",
       ToHex(ToBytes(">1RI1:17\r")),
       {{20ms, ToHex(ToBytes("$01A1\r"))}},
       Outcome::corrupt,
       other_master,
       "requests of DCON come ('$01A1')"},
      {"Spa9600",
       ToHex(ToBytes(">1RI1:17\r")),
       {{20ms, ToHex(ToBytes("\n<1D:0.52:50\n\n"))}},
       Outcome::partial,
       other_setting,
       "its replies end in two line feeds, not in a carriage return"},
      {"Spa9600",
       ToHex(ToBytes(">1RI1:17\r")),
       {{20ms, ToHex(ToBytes("\n<1D:0.52:50\n\r"))}},
       Outcome::corrupt,
       other_setting,
       "its replies end in a line feed and a carriage return, not in a carriage return"},
      {"Spa9600",
       ToHex(ToBytes(">1RI1:17\r")),
       {{20ms, ToHex(ToBytes("D:0.52:50\r\n"))}},
       Outcome::partial,
       head_lost,
       "a few"},
      {"Spa9600",
       ToHex(ToBytes(">1RI1:17\r")),
       {{20ms, ToHex(ToBytes("2:50\r\n"))}},
       Outcome::partial,
       head_lost,
       "a few"},
      {"ModbusAscii9600",
       kAscii,
       {{20ms, ToHex(ToBytes("04BAF\r\n"))}},
       Outcome::partial,
       head_lost,
       "a few"},
      {"Spa9600",
       ToHex(ToBytes(">1RI1:17\r")),
       {{20ms, ToHex(ToBytes("\n<1D:0.2:50\r\n"))}},
       Outcome::corrupt,
       bad_check,
       "a text"},
      {"Spa9600",
       ToHex(ToBytes(">1RF:21\r")),
       {{20ms, ToHex(ToBytes("SPCJ 4D29:1B\r\n"))}},
       Outcome::corrupt,
       head_lost,
       "a few"},
      {"ModbusAscii9600",
       ToHex(ToBytes(":010300000001FB\r\n")),
       {{20ms, ToHex(ToBytes(":01030200BAF\r\n"))}},
       Outcome::corrupt,
       bytes_lost},
      {"ModbusAscii9600",
       ToHex(ToBytes(":010300000001FB\r\n")),
       {{20ms, ToHex(ToBytes(":010702004BAB\r\n"))}},
       Outcome::unexpected,
       other_reply,
       "its replies have function 07 where 03 was asked"},
      // Whole with A2 in its middle; and with 27 in front of 3F.
      {"Set4tm9600", "1408003604", {{20ms, "14008974060902DA14"}}, Outcome::partial, bytes_lost},
      {"Set4tm9600",
       "1405000015D5",
       {{20ms, "1400003F00000000000013890000006552FB"}},
       Outcome::partial,
       bytes_lost},
      {"Set4tm9600", "1408003604", {{20ms, "140089A274"}}, Outcome::partial, tail_lost},
      {"ModbusTcp",
       kTcp,
       {{20ms, "FFFB01FFFD03"}},
       Outcome::corrupt,
       other_protocol,
       "the server speaks Telnet"},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, kRtuReply + ToHex(ToBytes("HB0001"))}},
       Outcome::ok,
       text_beside,
       "'HB0001'"},
      {"Dcon9600",
       ToHex(ToBytes("#0184\r")),
       {{20ms, "BEABB1B0B0AEB2B3ABB0B3B4AEB0B5C5B28D"}},
       Outcome::corrupt,
       eighth_bit,
       "mark"},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, ToHex(ToBytes("S S 100.01 g\r\nS S 100.02 g\r\nS S 100.03 g\r\n"))}},
       Outcome::partial,
       text,
       "'S S 100.01 g\\r\\nS S 100.02 g\\r\\nS ...'"},
      {"ModbusRtu19200", kRtu, {{20ms, kRtu}}, Outcome::no_reply, echo},
      {"ModbusRtu19200", kRtu, {{180ms, kRtuReply}}, Outcome::no_reply, late},
      {"ModbusRtu19200", kRtu, {{20ms, "010302"}, {120ms, "004BF873"}}, Outcome::partial, split},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, "010302004BF970"}, {120ms, "5A"}},
       Outcome::corrupt,
       bytes_added},
      {"ModbusAscii9600",
       ToHex(ToBytes(":010300000001FB\r\n")),
       {{20ms, ToHex(ToBytes(":01030BAF\r\n"))}},
       Outcome::corrupt,
       bytes_lost},
      {"ModbusRtu19200", kRtu, {{20ms, "0302004BF873"}}, Outcome::partial, head_lost},
      {"ModbusRtu19200", kRtu, {{20ms, "01030200"}}, Outcome::partial, tail_lost},
      {"ModbusRtu19200", kRtu, {{20ms, "010302004BF970"}}, Outcome::corrupt, bad_check},
      {"ModbusRtu19200", kRtu, {{20ms, "010302004BF870"}}, Outcome::corrupt, end_lost, "garbled"},
      {"ModbusRtu19200", kRtu, {{20ms, "F80302004BF873"}}, Outcome::corrupt, head_lost, "garbled"},
      {"Dcon115200",
       ToHex(ToBytes("$01MD2\r")),
       {{20ms, "F0" + ToHex(ToBytes("01MV110B7\r"))}},
       Outcome::corrupt,
       head_lost,
       "garbled"},
      {"Dcon9600",
       ToHex(ToBytes("#0184\r")),
       {{20ms, ToHex(ToBytes(">+04,50+02,517D\r"))}},
       Outcome::unexpected,
       other_setting,
       "a comma comes where a point is awaited ('>+04,50+02,517D\\r')"},
      {"ModbusRtu19200", kRtu, {{20ms, "9C7741E255D1"}}, Outcome::corrupt, noise},
      {"ModbusRtu19200", kRtu, {{20ms, "00FF0000"}}, Outcome::no_reply, zeros},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, ToHex(ToBytes("\r\nlogin: "))}},
       Outcome::corrupt,
       text,
       "'\\r\\nlogin: '"},
      {"ModbusRtu19200", kRtu, {{20ms, ToHex(Bytes(300, 0x41))}}, Outcome::corrupt, endless},
      {"ModbusRtu19200",
       kRtu,
       {{20ms, "090302004B19B2"}},
       Outcome::unexpected,
       other_device,
       "slave 9 answers where slave 1 was asked"},
      {"ModbusRtu19200",
       kRtu,
       {{20ms,
         "00050000000501030200"
         "4B"}},
       Outcome::corrupt,
       other_protocol,
       "messages of Modbus TCP come back"},
      {"ModbusTcp",
       kTcp,
       {{20ms, ToHex(ToBytes("HTTP/1.1 400 Bad Request\r\n"))}},
       Outcome::corrupt,
       other_protocol,
       "a web server answers"},
      {"ModbusTcp",
       kTcp,
       {{20ms, "68040B000000"}},
       Outcome::corrupt,
       other_protocol,
       "an IEC 60870-5-104 server answers"},
      {"ModbusTcp",
       kTcp,
       {{20ms, "0300001611D00001000200C0010AC1020100C2020102"}},
       Outcome::corrupt,
       other_protocol,
       "an S7 or IEC 61850 server answers (ISO on TCP)"},
      {"ModbusTcp",
       kTcp,
       {{20ms, "15030100020232"}},
       Outcome::corrupt,
       other_protocol,
       "the server wants TLS"},
      {"ModbusTcp", kTcp, {{20ms, "0005000000050103020042"}}, Outcome::ok, clean},
      {"ModbusTcp",
       kTcp,
       {{20ms, kRtuReply}},
       Outcome::corrupt,
       other_protocol,
       "messages of Modbus RTU come back"},
      {"ModbusTcp",
       kTcp,
       {{20ms, "0009000000050103020042"}},
       Outcome::unexpected,
       other_reply,
       "its replies carry another transaction number (9) than their requests (5)"},
      {"ModbusTcp",
       kTcp,
       {{20ms, "0005000000090103020042"}},
       Outcome::partial,
       other_reply,
       "the header of its replies counts 9 bytes where 5 follow"},
      {"ModbusTcp",
       kTcp,
       {{20ms, "0005000100050103020042"}},
       Outcome::corrupt,
       other_reply,
       "the header of its replies has protocol number 1 in place of 0"},
      {"ModbusTcp", kTcp, {{20ms, "0005000000050103"}}, Outcome::partial, tail_lost},
  };
  for (const Row& row : rows) {
    std::string came;
    for (const Came& one : row.came) came += one.hex + " ";
    const Finding finding = Look(row);
    EXPECT_EQ(static_cast<int>(finding.symptom), static_cast<int>(row.symptom)) << came;
    EXPECT_EQ(finding.cause, row.cause) << came;
  }
}

/// The remedy of a text that came in place of a reply.
TEST(Examine, ATextSaysWhatItIs) {
  const struct {
    std::string text;
    std::string remedy;
  } rows[] = {
      {"\r\nDebian GNU/Linux 11 plc7 ttyS0\r\n\r\nplc7 login: ",
       "a login prompt: switch the console (getty) off at the other end, or check the port"},
      {"\r\nPassword: ",
       "a login prompt: switch the console (getty) off at the other end, or check the port"},
      {"\r\n\r\nMain menu\r\n", ""},
      {"S S 100.01 g\r\nS S 100.02 g\r\n",
       "it sends by itself, asked or not: switch its automatic (continuous) output off"},
      {"Port is in use\r\n", "end its other client, or raise its limit of connections"},
  };
  for (const auto& row : rows) {
    const Finding finding =
        Look({"ModbusRtu19200", kRtu, {{20ms, ToHex(ToBytes(row.text))}}, Outcome::corrupt, text});
    EXPECT_EQ(finding.symptom, text) << row.text;
    EXPECT_EQ(finding.remedy, row.remedy) << row.text;
  }
  const Finding boot = Look({"Spa9600",
                             ToHex(ToBytes(">1RI1:17\r")),
                             {{20ms, ToHex(ToBytes("BOOT 1.02\r\n"))}},
                             Outcome::partial,
                             text});
  EXPECT_EQ(boot.symptom, text) << "where replies are text as well";
}

TEST(Examine, WhatComesBehindAPasswordIsNotQuoted) {
  const auto& setup = RealLine("Spa9600");
  const config::Device device = LineOf(setup).devices[0];
  const ParsedOptions options = ParseOptions(*setup.protocol, device.options);
  const Bytes request = ToBytes(">1WV160:234:44\r");
  const Expectation expect = setup.protocol->expect(request, options);
  ASSERT_FALSE(expect.secrets.empty());
  const Bytes heard = ToBytes("password is wrong: 234\r\n");
  const Arrival arrivals[] = {{0, 20ms}};
  const Finding finding = Examine({.protocol = setup.protocol,
                                   .options = &options,
                                   .request = request,
                                   .expect = &expect,
                                   .outcome = Outcome::corrupt,
                                   .heard = heard,
                                   .arrivals = arrivals,
                                   .reply = 100ms,
                                   .gap = 50ms});
  EXPECT_EQ(finding.symptom, text);
  EXPECT_EQ(finding.cause.find("234"), std::string::npos) << finding.cause;
}

}  // namespace
}  // namespace baudgate
