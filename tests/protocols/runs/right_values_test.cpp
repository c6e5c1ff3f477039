// Random hours in which the settings of devices, and the devices themselves, change. After each
// change another simulated device answers, whose true values the test has. From one slow period
// after the change on, no good reading must be wrong, and a contradiction must be reported.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <deque>
#include <functional>
#include <ostream>
#include <random>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "gateway/bus/points/point_store.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/protocol.h"
#include "protocols/modbus/codec.h"
#include "protocols/set4tm/protocol.h"
#include "protocols/spabus/protocol.h"
#include "tests/protocols/runs/lag_line.h"
#include "tests/protocols/runs/lagging_server.h"
#include "tests/protocols/runs/rig.h"
#include "tests/support/long_run.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols {
namespace {

constexpr Duration kSlow = 10s;
constexpr std::int64_t kMeterSerial = 9020001;
constexpr std::int64_t kWrongSerial = 7654321;

/// A device that can replace the right device, described by its differences from the right device.
struct Oddity {
  std::string name;
  std::function<void(config::Device&)> options = [](config::Device&) {};
  std::function<void(Twin&)> settings = [](Twin&) {};
  std::vector<std::pair<std::string, std::string>> says{};
  /// Factor between this device's value and the right device's value; nothing: the point has no
  /// true value.
  std::function<std::optional<double>(const config::Point& point)> means =
      [](const config::Point&) { return std::nullopt; };
  bool is_named = true;    ///< true: the state or trouble of the device must report the difference
  bool in_place = true;    ///< true: the change is a setting, so it can happen without an outage
  Duration shows = kSlow;  ///< within this time the difference must be reported
};

struct Case {
  std::string name;
  Setup setup;
  std::vector<Oddity> oddities;
};

void PrintTo(const Case& which, std::ostream* out) { *out << which.name; }

std::function<void(config::Device&)> Option(const std::string& key, config::OptionValue value) {
  return [=](config::Device& device) { device.options.Set(key, value); };
}

std::function<std::optional<double>(const config::Point&)> AllBut(const std::string& input) {
  return [=](const config::Point& point) {
    return point.read == input ? std::nullopt : std::optional(1.0);
  };
}

std::function<void(Twin&)> InputType(const std::string& type) {
  return
      [=](Twin& twin) { twin.Answer(protocols::dcon::BuildRequest("$7C1R" + type, 1, false), {}); };
}

Setup SetupOf(const Protocol& protocol, const std::string& profile) {
  Setup setup;
  setup.protocol = &protocol;
  setup.profile = profile;
  setup.serial = protocol.serial;
  setup.addresses = {"1"};
  return setup;
}

std::vector<Case> Cases() {
  const auto volts = [](const config::Point& point) {
    return std::optional(point.unit == "V" ? 0.001 : 1.0);
  };
  std::vector<Case> cases;
  cases.push_back({"Dcon7017",
                   SetupOf(DconProtocol(), "icpdas-i-7017"),
                   {{.name = "percent", .options = Option("format", std::string("percent"))},
                    {.name = "hex", .options = Option("format", std::string("hex"))},
                    {.name = "checksum", .options = Option("checksum", true), .shows = 1min},
                    {.name = "milliamperes", .says = {{"configuration", "0D0600"}}},
                    {.name = "thermocouples", .says = {{"configuration", "0F0600"}}},
                    {.name = "millivolts",
                     .says = {{"configuration", "0B0600"}},
                     .means = volts,
                     .is_named = false},
                    {.name = "one input less",
                     .options = Option("enable_mask", std::int64_t{0xFE}),
                     .says = {},
                     .means = AllBut("#[0]"),
                     .is_named = false},
                    {.name = "a 7060",
                     .says = {{"module_name", "7060"}, {"configuration", "400600"}},
                     .in_place = false}}});
  cases.push_back({"Dcon4017Plus",
                   SetupOf(DconProtocol(), "adam-4017plus"),
                   {{.name = "input 1 in mA",
                     .settings = InputType("0D"),
                     .means = AllBut("#[1]"),
                     .shows = kSlow + 2s},
                    {.name = "input 1 in mV",
                     .settings = InputType("0C"),
                     .means =
                         [](const config::Point& point) {
                           return std::optional(point.read == "#[1]" ? 0.001 : 1.0);
                         },
                     .is_named = false,
                     .shows = kSlow + 2s},
                    {.name = "percent", .options = Option("format", std::string("percent"))}}});
  cases.push_back({"Spa",
                   SetupOf(SpabusProtocol(), "spaj140c"),
                   {{.name = "another relay",
                     .says = {{"type_designation", "SPAU 130 C"}},
                     .in_place = false}}});
  cases.push_back({"Set4tm",
                   SetupOf(Set4tmProtocol(), "set-4tm.03m"),
                   {{.name = "another meter",
                     .options = Option("serial_number", kWrongSerial),
                     .in_place = false}}});
  return cases;
}

class RightValues : public ::testing::TestWithParam<Case> {
 protected:
  RightValues() : random_(20261123) {
    config::Line line = LineOf(GetParam().setup);
    config::Device& device = line.devices[0];
    device.slow = kSlow;
    device.identity.others = {{config::SpokenName("7060"), "icpdas-i-7060"},
                              {config::SpokenName("SPAU 130 C"), "spau130c"}};
    if (GetParam().setup.protocol->name == "set4tm")
      device.options.Set("serial_number", kMeterSerial);
    line.options = device.options;
    std::vector<config::Device> others;
    for (const Oddity& oddity : GetParam().oddities) {
      others.push_back(device);
      oddity.options(others.back());
    }
    line_ = std::make_unique<VirtualLine>(std::move(line), std::vector{GetParam().setup.protocol},
                                          std::move(others));
    line_->keep_sent = false;
    for (std::size_t twin = 0; twin <= GetParam().oddities.size(); ++twin) SetUp(twin);
  }

  const config::Device& device() { return *line_->store().device(0); }
  const Oddity& OddityOf(std::size_t twin) { return GetParam().oddities[twin - 1]; }

  /// All simulated devices measure the same numbers, whatever unit or scale their settings give
  /// them.
  void SetUp(std::size_t twin) {
    VirtualLine::WireTwin& wired = line_->twin(twin);
    for (std::size_t i = 0; i < device().points.size(); ++i) {
      const config::Point& point = device().points[i];
      if (!point.simulate) continue;
      const config::Simulate& shows = *point.simulate;
      Value value = ((shows.low - point.offset) / point.scale).ToDouble();
      if (point.type == config::Type::boolean) value = shows.low != 0;
      if (shows.text) value = *shows.text;
      if (twin > 0) {
        for (const auto& [name, text] : OddityOf(twin).says) {
          if (point.name == name) value = text;
        }
      }
      wired.values.Set(i, value);
    }
    if (twin > 0) OddityOf(twin).settings(*wired.twin);
    wired.manner.dead = twin > 0;
  }

  bool AllGood() {
    bool good = true;
    line_->store().Read(0, [&](const bus::DeviceRecord& record) {
      for (std::size_t i = 0; i < record.points.size(); ++i) {
        good = good && IsGood(QualityAt(record, i, line_->now().instant));
      }
    });
    return good;
  }

  void LearnTruth() {
    line_->Open();
    ASSERT_TRUE(line_->RunUntil([this] { return AllGood(); }, 5min));
    line_->store().Read(0, [&](const bus::DeviceRecord& record) {
      for (const bus::PointRecord& point : record.points) truth_.push_back(point.value);
    });
  }

  void Change(std::size_t twin) {
    const bool in_place = (twin == 0 || OddityOf(twin).in_place) &&
                          (there_ == 0 || OddityOf(there_).in_place) && random_() % 2 == 0;
    line_->twin(there_).manner.dead = true;
    if (!in_place) line_->RunFor(30s + std::chrono::milliseconds(random_() % 60'000));
    shows_ = std::max(ShowsOf(there_), ShowsOf(twin));
    there_ = twin;
    since_ = line_->now().instant;
    line_->twin(there_).manner.dead = false;
  }
  Duration ShowsOf(std::size_t twin) { return twin == 0 ? kSlow : OddityOf(twin).shows; }

  void Look() {
    const Instant due = since_ + shows_ + kPoll;
    if (line_->now().instant < due || line_->twin(there_).manner.dead) return;
    line_->store().Read(0, [&](const bus::DeviceRecord& record) {
      for (std::size_t i = 0; i < record.points.size(); ++i) {
        const config::Point& point = device().points[i];
        const bool number = point.type != config::Type::string;
        if (point.group != config::Group::fast || !number) continue;
        if (!IsGood(QualityAt(record, i, line_->now().instant))) continue;
        ++judged_;
        const auto factor = there_ == 0 ? std::optional(1.0) : OddityOf(there_).means(point);
        const double truth = ToDouble(truth_[i]);
        const double shown = ToDouble(record.points[i].value);
        if (factor && std::abs(shown - truth * *factor) <= std::abs(truth) * 1e-4 + 1e-6) continue;
        if (++wrong_ > 3) continue;
        ADD_FAILURE() << point.name << " shows " << shown << " as good, " << Name()
                      << " is there since " << FormatDuration(line_->now().instant - since_);
      }
    });
  }
  std::string Name() { return there_ == 0 ? "the right one" : OddityOf(there_).name; }

  void ExpectNamed() {
    const std::string trouble = line_->StatusOf(0).trouble;
    const bool named = there_ != 0 && OddityOf(there_).is_named;
    EXPECT_EQ(!trouble.empty(), named) << Name() << ": '" << trouble << "'";
    if (!named) return;
    bool reason = false;
    line_->store().Read(0, [&](const bus::DeviceRecord& record) {
      for (std::size_t i = 0; i < record.points.size(); ++i) {
        const Reason why = QualityAt(record, i, line_->now().instant).reason;
        reason = reason || why == Reason::other_module || why == Reason::swapped;
      }
    });
    reason = reason || line_->StatusOf(0).state == bus::DeviceState::offline;
    EXPECT_TRUE(reason) << Name() << ": '" << trouble << "', state "
                        << static_cast<int>(line_->StatusOf(0).state) << ", "
                        << baudgate::Name(line_->QualityOf(0, 0));
  }

  static constexpr Duration kPoll = 6s;  // a poll, its retries and the requests before it

  std::mt19937 random_;
  std::unique_ptr<VirtualLine> line_;
  std::vector<Value> truth_;
  std::size_t there_ = 0;
  Instant since_{};
  Duration shows_ = kSlow;
  std::size_t judged_ = 0;
  std::size_t wrong_ = 0;
};

TEST_P(RightValues, NoValueThatTheDeviceDidNotSendIsGood) {
  LearnTruth();
  if (HasFatalFailure()) return;
  line_->always = [this] { Look(); };
  const Instant end = line_->now().instant + 1h;
  std::size_t changes = 0;
  while (line_->now().instant < end && !HasFailure()) {
    Change(there_ == 0          ? 1 + random_() % GetParam().oddities.size()
           : random_() % 3 != 0 ? 0
                                : 1 + random_() % GetParam().oddities.size());
    ++changes;
    line_->RunFor(shows_ + kPoll);
    ExpectNamed();
    line_->RunFor(std::chrono::milliseconds(random_() % 20'000));
  }
  EXPECT_GT(changes, 15U);
  Change(0);
  EXPECT_TRUE(line_->RunUntil([this] { return AllGood(); }, 5min)) << "the right one is back";
  EXPECT_GT(judged_, 1000U);
}

INSTANTIATE_TEST_SUITE_P(Lines, RightValues, ::testing::ValuesIn(Cases()),
                         [](const auto& info) { return info.param.name; });

// ---------------- Points with constant values, behind a server that falls permanently behind.
// Equal replies prove nothing about their order, but no point must show the value of another point.

using protocols::modbus::Framing;

constexpr std::size_t kRuns = 3000;
constexpr std::uint8_t kDiagnostics = 0x08;
constexpr std::size_t kUnit = 6;  // the server releases a reply only when the next reply arrives

/// each request releases the reply to the previous request, even if that was silence
enum class Falls : std::uint8_t {
  keeps_a_queue,     ///< like answers_silence, but a request without a reply is left out
  answers_silence,   ///< a request releases the reply to the previous request, even an empty reply
  answers_anything,  ///< like answers_silence, but requests without a reply are skipped
};

enum class Kind : std::uint8_t {
  no_loopback,         ///< Modbus RTU, ignores function 08
  one_register,        ///< Modbus RTU, answers every read with one register
  two_registers,       ///< Modbus RTU, answers every read with two registers
  name_is_value,       ///< SPA: its name equals the value of its first point
  converter,           ///< Modbus TCP to RTU: puts the current transaction id before each reply
  converter_of_units,  ///< like converter, for two devices: also puts the current unit before each
                       ///< reply
};

struct Constant {
  Kind kind;
  Falls falls;

  bool tcp() const { return kind >= Kind::converter; }
  std::size_t devices() const { return kind == Kind::converter_of_units ? 2 : 1; }
};

void PrintTo(const Constant& constant, std::ostream* out) {
  *out << static_cast<int>(constant.kind) << " that " << static_cast<int>(constant.falls);
}

double TruthOf(std::size_t device, std::size_t point) {
  return 100.0 * static_cast<double>(2 * device + point + 1);
}

config::Line LineOf(const Constant& constant) {
  LagCase which = LagCaseOf("ModbusRtu19200", Queries::two, Proof::silent);
  if (constant.kind == Kind::name_is_value) {
    which = LagCaseOf("Spa9600", Queries::two, Proof::answered);
  }
  if (constant.tcp()) which.setup = TcpLine();
  config::Line line = LagLineOf(which);
  line.devices.resize(constant.devices());
  for (config::Device& device : line.devices) {
    device.poll = 1s;
    if (constant.kind == Kind::two_registers || constant.kind == Kind::name_is_value) continue;
    for (config::Point& point : device.points) {
      point.type = config::Type::uint16;
      point.read += " uint16";
    }
  }
  return line;
}

Bytes SayRegisters(View request, Bytes reply, std::size_t count) {
  const auto asked = protocols::modbus::Unwrap(Framing::rtu, request);
  if (reply.empty() || !asked || asked->pdu.size() < 5) return reply;
  const std::size_t point = asked->pdu[2] < 100 ? 0 : 1;
  Bytes pdu = {asked->pdu[0], static_cast<std::uint8_t>(2 * count)};
  const double truth = TruthOf(0, point);
  const auto bits = count == 1 ? static_cast<std::uint32_t>(truth)
                               : std::bit_cast<std::uint32_t>(static_cast<float>(truth));
  for (std::size_t byte = 2 * count; byte > 0; --byte) {
    pdu.push_back(static_cast<std::uint8_t>(bits >> (8 * (byte - 1))));
  }
  return protocols::modbus::Wrap(Framing::rtu, asked->slave, pdu);
}

Bytes SayName(View request, Bytes reply) {
  const std::string_view text = AsText(request);
  const bool second = text.find("RI3") != std::string_view::npos;
  if (reply.empty() || text.find('R') == std::string_view::npos) return reply;
  Bytes said = ToBytes(second ? "<1D:200:" : "<1D:100:");
  Append(said, HexByte(Xor8(said)) + "\r\n");
  return said;
}

class ConstantValues : public ::testing::TestWithParam<Constant> {
 protected:
  static Bytes Say(View request, Bytes reply) {
    switch (GetParam().kind) {
      case Kind::no_loopback:
        return request[1] == kDiagnostics ? Bytes() : reply;
      case Kind::one_register:
        return SayRegisters(request, std::move(reply), 1);
      case Kind::two_registers:
        return SayRegisters(request, std::move(reply), 2);
      case Kind::name_is_value:
        return SayName(request, std::move(reply));
      case Kind::converter:
      case Kind::converter_of_units:
        break;
    }
    return reply;
  }

  /// Writes the transaction id of the current request into each piece, as a converter does. If
  /// there is no piece, adds an exception.
  void Stamp(View request, std::vector<tools::TimedPiece>& pieces) const {
    if (!GetParam().tcp()) return;
    const bool units = GetParam().kind == Kind::converter_of_units;
    for (tools::TimedPiece& piece : pieces) {
      std::copy_n(request.begin(), 2, piece.bytes.begin());
      if (units) piece.bytes[kUnit] = request[kUnit];
    }
    if (!pieces.empty() || says_nothing_ == 0) return;
    const auto asked = protocols::modbus::Unwrap(Framing::tcp, request);
    const Bytes pdu = {static_cast<std::uint8_t>(asked->pdu[0] | 0x80U), says_nothing_};
    pieces.push_back(
        {200ms, protocols::modbus::Wrap(Framing::tcp, asked->slave, pdu, asked->transaction)});
  }

  /// Counts how often a point was good with another point's value, or not good. `falls`: the server
  /// falls behind after a few seconds.
  void Run(std::mt19937& random, bool falls, Duration time) {
    constexpr std::uint8_t kSilences[] = {0, 0x0A, 0x0B};
    says_nothing_ = kSilences[random() % 3];
    VirtualLine line(line_, {FindProtocol()});
    line.keeps_bit_rate = !GetParam().tcp() && random() % 2 == 0;
    tools::TwinWire wire;
    wire.think = std::chrono::microseconds(random() % 40'000);
    LaggingServer server(wire, 1);
    std::deque<Bytes> held;
    bool fallen = false;
    line.server = [&](View request, Bytes reply, Instant end) {
      reply = Say(request, std::move(reply));
      if (GetParam().falls != Falls::keeps_a_queue && fallen) {
        const bool waits = !reply.empty() || GetParam().falls == Falls::answers_silence;
        if (waits) held.push_back(std::exchange(reply, {}));
        const std::size_t behind = waits ? 1 : 0;
        if (held.size() > behind) {
          reply = held.front();
          held.pop_front();
        }
      }
      auto pieces = server.OnRequest(request, std::move(reply), end);
      Stamp(request, pieces);
      return pieces;
    };
    for (std::size_t device = 0; device < GetParam().devices(); ++device) {
      for (std::size_t i = 0; i < line_.devices[device].points.size(); ++i) {
        line.twin(device).values.Set(i, TruthOf(device, i));
      }
    }
    line.always = [&] { Look(line); };
    line.Open();
    line.RunFor(6s + std::chrono::microseconds(random() % 4'000'000));
    seen_ = not_good_ = 0;
    fallen = falls;
    if (falls && GetParam().falls == Falls::keeps_a_queue) server.faults.behind = 1 + random() % 2;
    line.RunFor(time);
  }
  void Look(VirtualLine& line) {
    for (std::uint32_t device = 0; device < GetParam().devices(); ++device) {
      for (std::uint32_t i = 0; i < line_.devices[device].points.size(); ++i) {
        const bool good = IsGood(line.QualityOf(device, i));
        ++seen_;
        if (!good) ++not_good_;
        if (good && ToDouble(line.ValueOf(device, i)) != TruthOf(device, i)) ++wrong_;
      }
    }
  }
  const Protocol* FindProtocol() const {
    if (GetParam().tcp()) return TcpLine().protocol;
    const bool spa = GetParam().kind == Kind::name_is_value;
    return RealLine(spa ? "Spa9600" : "ModbusRtu19200").protocol;
  }

  const config::Line line_ = LineOf(GetParam());
  std::uint8_t says_nothing_ = 0;  // exception code if there is no reply; 0: no exception is sent
  std::size_t seen_ = 0;
  std::size_t not_good_ = 0;
  std::size_t wrong_ = 0;
};

TEST_P(ConstantValues, AreNeverExchanged) {
  std::mt19937 random(20261126);
  for (std::size_t run = 0; run < LongRun(kRuns) / 6; ++run) {
    Run(random, true, 90s);
    ASSERT_EQ(wrong_, 0U) << run;
  }
}

TEST_P(ConstantValues, AreGoodWithoutALaggingServer) {
  std::mt19937 random(20261126);
  Run(random, false, 10min);
  EXPECT_EQ(wrong_, 0U);
  EXPECT_EQ(not_good_, 0U) << "of " << seen_;
}

std::vector<Constant> Constants() {
  std::vector<Constant> all;
  for (int kind = 0; kind <= static_cast<int>(Kind::converter_of_units); ++kind) {
    for (const Falls falls :
         {Falls::keeps_a_queue, Falls::answers_silence, Falls::answers_anything}) {
      all.push_back({static_cast<Kind>(kind), falls});
    }
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Servers, ConstantValues, ::testing::ValuesIn(Constants()));

}  // namespace
}  // namespace baudgate::protocols
