// Tests that all requests and replies printed in the references are decoded without a profile.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>

#include "config/catalog/option_values.h"
#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "protocols/assembler.h"
#include "tests/config/shipped.h"
#include "tests/protocols/printed/printed_script.h"
#include "tests/support/talk.h"

namespace baudgate::protocols {
namespace {

constexpr std::string_view kFolder = "tests/protocols/printed/";

Bytes Dcon(std::string text, const config::Options& options) {
  if (options.Flag("checksum")) text += HexByte(Sum8(ToBytes(text)));
  return ToBytes(text + "\r");
}

Bytes Spa(std::string text) {
  text += HexByte(Xor8(ToBytes(text)));
  return ToBytes(text.starts_with('<') ? "\n" + text + "\r\n" : text + "\r");
}

Bytes WithCrc(const std::string& hex) {
  Bytes frame = ParseHex(hex).value_or(Bytes());
  EXPECT_FALSE(frame.empty()) << "these are not hex bytes: " << hex;
  AppendCrc16(frame);
  return frame;
}

Bytes OnWire(const Protocol& protocol, const std::string& text, const config::Options& options) {
  if (protocol.name == "dcon") return Dcon(text, options);
  return protocol.name == "spabus" ? Spa(text) : WithCrc(text);
}

std::string Shown(const Reading& reading) {
  EXPECT_EQ(reading.point, kNoPoint);
  std::string value = ToText(reading.value);
  if (!IsGood(reading.quality)) value = IsBad(reading.quality) ? "[bad]" : "[uncertain]";
  return std::string(Trim(reading.label + " = " + value));
}

Answer Decode(const Protocol& protocol, Conversation& conversation, const Bytes& request,
              const Bytes& reply, const config::Options& options) {
  Expectation expect = protocol.expect(request, ParseOptions(protocol, options));
  if (expect.reply == Expectation::Reply::none) return {};
  const Bytes frame = CutFrame(protocol.reply_rule, std::move(expect), reply);
  if (!frame.empty()) return conversation.Interpret(request, frame);
  Answer answer;
  answer.outcome = Outcome::no_reply;
  return answer;
}

class Printed : public ::testing::TestWithParam<const char*> {};

TEST_P(Printed, ExchangesAreDecodedAsPrinted) {
  const Protocol* protocol = testing::Shipped().FindProtocol(GetParam());
  ASSERT_NE(protocol, nullptr);
  const std::string path = std::string(kFolder) + GetParam() + ".printed";
  std::size_t exchanges = 0;
  for (const PrintedPart& part : ReadPrintedScript(path)) {
    config::Device device = DeviceOf(*protocol, "1", {});
    for (const auto& [name, text] : part.options) {
      const auto spec = std::ranges::find(protocol->options, name, &OptionSpec::name);
      ASSERT_NE(spec, protocol->options.end()) << path << ": no option " << name;
      const auto value = config::ParseOption(*spec, text);
      ASSERT_TRUE(value) << path << ": " << value.error();
      device.options.Set(name, *value);
    }
    const auto bus = MakeBus(*protocol);
    const auto conversation = MakeConversation(*protocol, device, bus.get());
    for (const PrintedExchange& exchange : part.exchanges) {
      ++exchanges;
      const Bytes request = OnWire(*protocol, exchange.request, device.options);
      const Bytes reply =
          exchange.reply ? OnWire(*protocol, *exchange.reply, device.options) : Bytes();
      const Answer answer = Decode(*protocol, *conversation, request, reply, device.options);
      std::vector<std::string> values;
      for (const Reading& reading : answer.readings) values.push_back(Shown(reading));
      EXPECT_EQ(Name(answer.outcome), exchange.outcome)
          << path << ":" << exchange.line << ": " << exchange.request << ": " << answer.reason;
      EXPECT_EQ(values, exchange.values)
          << path << ":" << exchange.line << ": " << exchange.request << ": " << answer.reason;
    }
  }
  EXPECT_GT(exchanges, 10U);
}

INSTANTIATE_TEST_SUITE_P(Protocols, Printed,
                         ::testing::Values("dcon", "spabus", "set4tm", "modbus_rtu"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace baudgate::protocols
