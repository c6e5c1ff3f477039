// Points that always read the same, behind a server that falls one or two replies behind and stays
// so: identical replies tell nothing of their order, and one point must never show another's value.
// Each kind of device lacks something that would prove the order.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <deque>
#include <functional>
#include <ostream>
#include <random>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "protocols/modbus/codec.h"
#include "tests/protocols/runs/lag_line.h"
#include "tests/protocols/runs/lagging_server.h"
#include "tests/support/long_run.h"
#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

using protocols::modbus::Adu;
using protocols::modbus::Framing;

constexpr std::size_t kRuns = 3000;
constexpr std::uint8_t kDiagnostics = 0x08;
constexpr std::size_t kUnit = 6;  // its place in the header of Modbus TCP

/// What the server does once it has fallen behind.
enum class Falls : std::uint8_t {
  keeps_a_queue,     ///< a reply releases the one before it
  answers_silence,   ///< a request releases the reply to the one before it, even an empty one
  answers_anything,  ///< the same, but where the device was silent nothing is put in its place
};

enum class Kind : std::uint8_t {
  no_loopback,         ///< Modbus RTU, silent to function 08
  one_register,        ///< Modbus RTU, answers every read with one register, as its polls want
  two_registers,       ///< the same with two
  name_is_value,       ///< SPA: its name equals the value of its first point
  converter,           ///< Modbus TCP to RTU, puts the present number before whatever comes
  converter_of_units,  ///< the same, with a unit for each of two devices, and the present unit
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

/// Every read is answered with so many registers, from where it begins.
Bytes SayRegisters(View request, Bytes reply, std::size_t count) {
  const auto asked = protocols::modbus::Unwrap(Framing::rtu, request);
  if (reply.empty() || !asked || asked->pdu.size() < 5) return reply;
  const std::size_t point = asked->pdu[2] < 100 ? 0 : 1;  // inputs 0 and 200
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
  /// What the devices behind the server say.
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

  /// A converter gives what comes the number of the present request, and says so where nothing
  /// does.
  void Stamp(View request, std::vector<TimedPiece>& pieces) const {
    if (!GetParam().tcp()) return;
    const bool units = GetParam().kind == Kind::converter_of_units;
    for (TimedPiece& piece : pieces) {
      std::copy_n(request.begin(), 2, piece.bytes.begin());
      if (units) piece.bytes[kUnit] = request[kUnit];
    }
    if (!pieces.empty() || says_nothing_ == 0) return;
    const auto asked = protocols::modbus::Unwrap(Framing::tcp, request);
    const Bytes pdu = {static_cast<std::uint8_t>(asked->pdu[0] | 0x80U), says_nothing_};
    pieces.push_back(
        {200ms, protocols::modbus::Wrap(Framing::tcp, asked->slave, pdu, asked->transaction)});
  }

  /// How often a point was good with another's value, and how often it was not good. `falls`: the
  /// server falls behind after a few seconds.
  void Run(std::mt19937& random, bool falls, Duration time) {
    constexpr std::uint8_t kSilences[] = {0, 0x0A, 0x0B};
    says_nothing_ = kSilences[random() % 3];
    VirtualLine line(line_, {FindProtocol()});
    line.keeps_bit_rate = !GetParam().tcp() && random() % 2 == 0;
    TwinWire wire;
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
  std::uint8_t says_nothing_ = 0;  // exception where nothing comes; 0: none
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

/// A rule that doubts who has no proof, and answers well, is no rule.
TEST_P(ConstantValues, AreGoodWhereNothingFallsBehind) {
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
}  // namespace baudgate
