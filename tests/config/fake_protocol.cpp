// SPDX-License-Identifier: Apache-2.0
#include "tests/config/fake_protocol.h"

#include "gateway/base/text.h"

namespace baudgate::testing {
namespace {

using Kind = protocols::OptionSpec::Kind;
using Scope = protocols::OptionSpec::Scope;

constexpr auto kDevice = Scope::device;
constexpr auto kLine = Scope::line;

constexpr protocols::OptionSpec kOptions[] = {
    {"checksum", Kind::flag, "false", "with check characters", kDevice, 0, 0, ""},
    {"width", Kind::integer, "7", "characters of a value", kDevice, 1, 20, ""},
    {"ratio", Kind::real, "1", "of the transformer", kDevice, 0.1, 1000, ""},
    {"mode", Kind::choice, "fast", "how to ask", kDevice, 0, 0, "fast, slow, careful"},
    {"password", Kind::text, "000000", "of the channel", kDevice, 0, 0, "", true},
    {"pin", Kind::integer, "0", "of the keypad", kDevice, 0, 9999, "", true},
    {"pause", Kind::duration, "5ms", "before the next request", kDevice, 0, 0, ""},
    {"tags", Kind::texts, "a,b", "words", kDevice, 0, 0, ""},
    {"broadcast", Kind::flag, "true", "may be used", kLine, 0, 0, ""},
};

constexpr protocols::DecoderSpec kDecoders[] = {{"A1", "the first value"}};

Result<std::string> CanonicalAddress(std::string_view address) {
  const auto number = ParseInteger<int>(address.substr(address.starts_with('+') ? 1 : 0));
  if (number && *number >= 1 && *number <= 99) return std::to_string(*number);
  return Error{"'" + std::string(address) + "' is no address; allowed: 1…99"};
}

Status CheckPoint(const config::Point& point) {
  if (point.read.empty() || (point.read[0] == 'A' && ParseInteger<int>(point.read.substr(1)))) {
    return {};
  }
  return Error{"read '" + point.read + "' is not understood; write A and a number"};
}

Status CheckDevice(const config::Device& device) {
  if (device.options.Text("mode") != "slow" || device.options.Integer("width") < 20) return {};
  return Error{"mode slow has no room for width 20"};
}

class FakeConversation : public protocols::Conversation {
 public:
  explicit FakeConversation(const config::Device& device)
      : address_(ParseInteger<std::uint8_t>(device.address)) {
    for (std::size_t i = 0; i < device.points.size(); ++i) {
      queries_.push_back({device.points[i].group, {i}});
    }
  }
  std::span<const protocols::Query> Queries() const override { return queries_; }
  Result<protocols::Request> Ask(const protocols::Task& task, Instant) override {
    protocols::Request request;
    request.unlike_polls = task.kind == protocols::Task::Kind::probe;
    request.bytes = Bytes(10, address_.value_or(0));
    request.expect.shapes = {{0, 30, 40}, {1, 10, 20}};
    return request;
  }
  protocols::Answer OnFrame(const protocols::Task&, const protocols::Request&, View,
                            Instant) override {
    return {};
  }
  Outcome Check(View, View) const override { return Outcome::ok; }
  protocols::Answer Interpret(View, View) override { return {}; }

 private:
  std::optional<std::uint8_t> address_;
  std::vector<protocols::Query> queries_;
};

constexpr protocols::TimingRule kTimes = {.quiet = {.least = 5ms},
                                          .reply = {.least = 500ms},
                                          .gap = {.least = 25ms},
                                          .drain = {.least = 100ms},
                                          .longest = 1'000'000,
                                          .gaps = 0,
                                          .longest_time = {.least = 1500ms}};

}  // namespace

protocols::Protocol MakeFakeProtocol(std::string_view name) {
  protocols::Protocol protocol;
  protocol.name = name;
  protocol.title = "Fake, for tests";
  protocol.options = kOptions;
  protocol.decoders = kDecoders;
  protocol.canonical_address = CanonicalAddress;
  protocol.check_point = CheckPoint;
  protocol.check_device = CheckDevice;
  protocol.serial.baud = 19200;
  protocol.serial.parity = config::Parity::even;
  protocol.timing = kTimes;
  protocol.make_conversation = [](const config::Device& device, const protocols::ParsedOptions&,
                                  protocols::Bus*) -> std::unique_ptr<protocols::Conversation> {
    return std::make_unique<FakeConversation>(device);
  };
  return protocol;
}

protocols::Protocol MakeFakeCarrier(std::string_view name) {
  static const protocols::PduCarrier kRtu = {.framing = modbus::Framing::rtu};
  static const protocols::PduCarrier kOther;
  protocols::Protocol protocol = MakeFakeProtocol(name);
  protocol.carrier = name == "modbus_rtu" ? &kRtu : &kOther;
  return protocol;
}

const config::Catalog& FakeCatalog() {
  static const protocols::Protocol kFake = MakeFakeProtocol("fake");
  static const protocols::Protocol kOther = MakeFakeProtocol("other");
  static const config::Catalog kCatalog = {{{"fake", &kFake}, {"other", &kOther}},
                                           {},
                                           {"tests/config/nowhere", "tests/config/profiles"}};
  return kCatalog;
}

const config::Catalog& ModbusCatalog() {
  static const protocols::Protocol kFake = MakeFakeProtocol("fake");
  static const protocols::Protocol kAscii = MakeFakeCarrier("modbus_ascii");
  static const protocols::Protocol kRtu = MakeFakeCarrier("modbus_rtu");
  static const config::Catalog kCatalog = {
      {{"fake", &kFake}, {"modbus_ascii", &kAscii}, {"modbus_rtu", &kRtu}},
      {},
      {"tests/config/profiles"}};
  return kCatalog;
}

std::string Shown(const std::vector<config::Problem>& problems) {
  std::string text;
  for (const config::Problem& problem : problems) text += config::ToString(problem) + "\n";
  return text;
}

config::Loaded Load(const std::string& text) {
  return config::LoadText(text, "t.yaml", FakeCatalog());
}

config::Loaded LoadModbus(const std::string& text) {
  return config::LoadText(text, "t.yaml", ModbusCatalog());
}

std::string ProblemsOfDevice(const std::string& device) {
  return Shown(Load("lines:\n"
                    "- name: l\n"
                    "  port: /dev/l\n"
                    "  protocol: fake\n"
                    "  devices:\n"
                    "  - { name: d, address: 1, " +
                    device +
                    (device.find("profile") == std::string::npos
                         ? ", points: [{ name: p, read: A1, type: int16 }] }\n"
                         : " }\n"))
                   .problems);
}

std::string ProblemsOfPoint(const std::string& point) {
  return Shown(Load("lines:\n"
                    "- name: l\n"
                    "  port: /dev/l\n"
                    "  protocol: fake\n"
                    "  devices:\n"
                    "  - { name: d, address: 1, points: [\n"
                    "\n"
                    "          { " +
                    point + " } ] }\n")
                   .problems);
}

}  // namespace baudgate::testing
