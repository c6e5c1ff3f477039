// Tests `Examine`, which names the symptom of bytes that arrive in place of a reply.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/examine.h"

#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "tests/config/shipped.h"
#include "tests/protocols/runs/rig.h"
#include "tests/support/file_cases.h"

namespace baudgate::protocols {
namespace {

using enum Symptom;

struct Came {
  Duration after;
  std::string hex;
};

struct Row {
  std::string line;
  std::string request;
  std::vector<Came> came;
  Outcome outcome;
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
  std::vector<diagnosis::Arrival> arrivals;
  for (const Came& came : row.came) {
    arrivals.push_back({heard.size(), came.after});
    Append(heard, FromHex(came.hex));
  }
  return diagnosis::Examine({.protocol = setup.protocol,
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

/// Parses parts that are joined by "+": hex, or quoted text.
Bytes BytesOf(std::string_view written) {
  Bytes bytes;
  while (!written.empty()) {
    if (written[0] == '"') {
      std::size_t at = 1;
      for (; written[at] != '"'; ++at) {
        const bool escaped = written[at] == '\\';
        if (escaped) ++at;
        bytes.push_back(!escaped             ? static_cast<std::uint8_t>(written[at])
                        : written[at] == 'r' ? '\r'
                                             : '\n');
      }
      written.remove_prefix(at + 1);
    } else {
      const std::string_view hex = written.substr(0, written.find('+'));
      Append(bytes, FromHex(std::string(hex)));
      written.remove_prefix(hex.size());
    }
    if (!written.empty()) written.remove_prefix(1);
  }
  return bytes;
}

Outcome OutcomeOf(const std::string& name) {
  std::uint8_t number = 0;
  while (baudgate::Name(static_cast<Outcome>(number)) != name) ++number;
  return static_cast<Outcome>(number);
}

TEST(Examine, ReportsTheCauseOfABadReply) {
  const auto cases = ReadFileCases("tests/protocols/runs/examine.txt");
  EXPECT_GT(cases.size(), 80U);
  for (const FileCase& one : cases) {
    SCOPED_TRACE(one.place);
    const std::size_t space = one.given.at(0).find(' ');
    Row row{one.given[0].substr(0, space),
            ToHex(BytesOf(one.given.at(1))),
            {},
            OutcomeOf(one.given[0].substr(space + 1))};
    for (std::size_t i = 2; i < one.given.size(); ++i) {
      const std::size_t end = one.given[i].find("ms ");
      row.came.push_back({std::chrono::milliseconds(std::stoi(one.given[i])),
                          ToHex(BytesOf(std::string_view(one.given[i]).substr(end + 3)))});
    }
    const Finding finding = Look(row);
    const std::string cause = finding.cause.empty() ? "" : ": " + finding.cause;
    EXPECT_EQ(std::string(Name(finding.symptom)) + cause, one.results.at(0).second);
  }
}

TEST(Examine, ATextIsReportedWithItsProbableSource) {
  const struct {
    std::string text;
    std::string remedy;
  } rows[] = {
      {"\r\nDebian GNU/Linux 11 plc7 ttyS0\r\n\r\nplc7 login: ",
       "switch the console (getty) that asks for a login off at the other end, or check the port"},
      {"\r\nPassword: ",
       "switch the console (getty) that asks for a login off at the other end, or check the port"},
      {"\r\n\r\nMain menu\r\n", ""},
      {"S S 100.01 g\r\nS S 100.02 g\r\n",
       "it sends unasked: switch its automatic (continuous) output off"},
      {"Port is in use\r\n",
       "end the other client of the server, or raise its limit of connections"},
  };
  for (const auto& row : rows) {
    const Finding finding =
        Look({"ModbusRtu19200", kRtu, {{20ms, ToHex(ToBytes(row.text))}}, Outcome::corrupt});
    EXPECT_EQ(finding.symptom, text) << row.text;
    EXPECT_EQ(finding.remedy, row.remedy) << row.text;
  }
  const Finding boot = Look({"Spa9600",
                             ToHex(ToBytes(">1RI1:17\r")),
                             {{20ms, ToHex(ToBytes("BOOT 1.02\r\n"))}},
                             Outcome::partial});
  EXPECT_EQ(boot.symptom, text) << "where replies are text as well";
}

TEST(Examine, AReplyToAPasswordIsNotQuoted) {
  const auto& setup = RealLine("Spa9600");
  const config::Device device = LineOf(setup).devices[0];
  const ParsedOptions options = ParseOptions(*setup.protocol, device.options);
  const Bytes request = ToBytes(">1WV160:234:44\r");
  const Expectation expect = setup.protocol->expect(request, options);
  ASSERT_FALSE(expect.secrets.empty());
  const Bytes heard = ToBytes("password is wrong: 234\r\n");
  const diagnosis::Arrival arrivals[] = {{0, 20ms}};
  const Finding finding = diagnosis::Examine({.protocol = setup.protocol,
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

struct Words {
  std::string line;
  std::string request;
  std::string heard;
  std::string cause;
};

TEST(Recognise, ReportsRepliesThatNearlyFitTheProtocol) {
  const auto set4tm = [](const std::string& hex) {
    Bytes bytes = ParseHex(hex).value();
    return std::string(AsText(bytes));
  };
  const Words rows[] = {
      {"Dcon115200", "$01MD2\r", "!01MV110B7\r", ""},
      {"Dcon115200", "$01MD2\r", "!02MV110B8\r", "module 02 answers where 01 was asked"},
      {"Dcon115200", "$01MD2\r", "$07MD8\r",
       "another master sends on the line: it has sent '$07MD8'"},
      {"Dcon9600", "#0184\r", ">+100.23+034.05\r", "its replies carry no checksum"},
      {"Dcon9600", "#0184\r", ">+100.23+034.05FF\r", ""},
      {"Dcon9600", "#0184\r", ">01+100.23+034.0543\r", "its replies with '>' carry its address"},
      {"Dcon9600", "#0184\r", ">02+100.23+034.0544\r", ""},
      {"Spa9600", ">1RI1:17\r", "<7D:0.52:56\r\n", "slave 7 answers where slave 1 was asked"},
      {"Spa9600", ">1RI1:17\r", "<7D:0.52:67\r\n", ""},
      {"Spa9600", ">1RI1:17\r", "<1D:0.52:5A\r\n", "its checksums count the line feed before '<'"},
      {"Spa9600", ">1RI1:17\r", "<1D:0.52:\r\n", "its replies carry no checksum"},
      {"Spa9600", ">1RI1:17\r", "<D:0.52:50\r\n", "its replies carry no slave number"},
      {"Spa9600", ">1RI1:17\r", "<1D:73\r\n",
       "its replies have a correct check value, but another form ('<1D:73')"},
      {"Spa9600", ">1RI1:17\r", "<1D:74\r\n", ""},
      {"Spa9600", ">1RI1:17\r", ">9RF:XX\r",
       "another master sends on the line: it has asked slave 9"},
      {"Set4tm9600", set4tm("C8081B001177BB"), set4tm("05008066431234"), ""},
      {"Set4tm9600", set4tm("C8081B001177BB"), set4tm("FD0F0124"),
       "the GSM communicator (253) reports that the meter does not answer"},
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

TEST(Recognise, ReportsAnUnconfiguredChecksum) {
  const auto& setup = RealLine("Dcon9600");
  config::Device device = LineOf(setup).devices[0];
  device.options.Set("checksum", false);
  const auto found = setup.protocol->recognise(ToBytes("$01M\r"), ToBytes("!01MV110B7\r"),
                                               ParseOptions(*setup.protocol, device.options));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->cause + ": " + found->remedy,
            "its replies carry a checksum: set checksum: true in the configuration, or change the "
            "checksum in the module");
}

}  // namespace
}  // namespace baudgate::protocols
