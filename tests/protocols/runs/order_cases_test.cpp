// Seven cases in which a reply was attributed to the wrong request. No case must happen again.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdio>
#include <deque>
#include <functional>
#include <memory>
#include <random>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "gateway/bus/poller/poller.h"
#include "tests/protocols/runs/lag_rig.h"
#include "tests/protocols/runs/rig.h"
#include "tests/support/long_run.h"

namespace baudgate::protocols {
namespace {

/// A failure depends on the phase: when in a poll period the fault begins. ctest runs a tenth of
/// these phases.
constexpr std::size_t kPhases = 100;

void ForPhases(const std::function<void(Duration phase)>& run) {
  std::mt19937 random(20261126);
  for (std::size_t i = 0; i < LongRun(kPhases); ++i) {
    const Duration phase = std::chrono::microseconds(random() % 4'000'000);
    SCOPED_TRACE("phase " + FormatDuration(phase));
    run(phase);
    if (::testing::Test::HasFailure()) return;
  }
}

void OneDeviceEverySecond(config::Line& line) {
  line.devices.resize(1);
  line.devices[0].poll = 1s;
}

/// The slave does not answer function 08. The server holds one reply back once, and from then on
/// answers each request with the reply to the previous request.
TEST(OrderCases, TwoPointsAreNeverExchanged) {
  ForPhases([](Duration phase) {
    LagRig rig(LagCaseOf("ModbusRtu19200", Queries::two, Proof::silent), 1, [](config::Line& line) {
      OneDeviceEverySecond(line);
      for (config::Point& point : line.devices[0].points) {
        point.type = config::Type::uint16;
        point.read += " uint16";
      }
    });
    rig.Open();
    rig.RunFor(8s + phase);
    rig.server().faults.behind = 1;
    rig.RunFor(20min);
    EXPECT_EQ(rig.oracle().wrong(), 0U) << rig.oracle().what();
  });
}

struct LateByCount {
  LagCase which;
  std::size_t behind;
  Duration poll;
};

void PrintTo(const LateByCount& late, std::ostream* out) {
  *out << late.which.name() << ", " << late.behind << " behind";
}

class OneQuery : public ::testing::TestWithParam<LateByCount> {};

/// The line sends one query only, so the late reply to an earlier request has the right form and
/// point.
TEST_P(OneQuery, ShowsNoOldValueWithARecentTime) {
  const LateByCount& late = GetParam();
  ForPhases([&](Duration phase) {
    LagRig rig(late.which, 1, [&](config::Line& line) {
      line.devices.resize(1);
      line.devices[0].poll = late.poll;
    });
    rig.Open();
    rig.RunFor(3 * late.poll + phase);
    rig.server().faults.behind = late.behind;
    rig.RunFor(600 * late.poll);
    EXPECT_EQ(rig.oracle().wrong(), 0U) << rig.oracle().what();
  });
}

std::vector<LateByCount> OneQueries() {
  std::vector<LateByCount> all;
  const LagCase kinds[] = {LagCaseOf("Spa9600", Queries::one, Proof::answered),
                           LagCaseOf("Dcon115200", Queries::one, Proof::silent),
                           LagCaseOf("Dcon9600", Queries::one, Proof::answered),
                           LagCaseOf("Set4tm9600", Queries::one, Proof::answered),
                           LagCaseOf("ModbusRtu19200", Queries::one, Proof::answered)};
  for (const LagCase& which : kinds) {
    for (const std::size_t behind : {1U, 2U, 3U}) all.push_back({which, behind, 1s});
    all.push_back({which, 3, 1min});
  }
  return all;
}

std::string OneQueryName(const ::testing::TestParamInfo<LateByCount>& info) {
  return info.param.which.name() + std::to_string(info.param.behind) + "BehindEvery" +
         FormatDuration(info.param.poll);
}

INSTANTIATE_TEST_SUITE_P(OrderCases, OneQuery, ::testing::ValuesIn(OneQueries()), OneQueryName);

struct Exchanged {
  Duration off;
  Duration poll;
};

void PrintTo(const Exchanged& exchanged, std::ostream* out) {
  *out << FormatDuration(exchanged.off) << " off";
}

class AnotherDevice : public ::testing::TestWithParam<Exchanged> {
 protected:
  void Replace(const LagCase& which) {
    ForPhases([&](Duration phase) {
      LagRig rig(which, 1, [](config::Line& line) {
        for (config::Device& device : line.devices) device.poll = GetParam().poll;
      });
      rig.Open();
      rig.RunFor(7s + phase);
      rig.Replace(0, GetParam().off, true);
      rig.RunFor(50min);
      EXPECT_EQ(rig.oracle().wrong(), 0U) << rig.oracle().what();
    });
  }
};

/// `serial_number` is configured. The new meter has another number, and a closed channel (status
/// 05).
TEST_P(AnotherDevice, WithAnotherSerialNumberIsNeverAccepted) {
  Replace(LagCaseOf("Set4tm9600", Queries::many, Proof::answered));
}

TEST_P(AnotherDevice, IsNeverMixedWithValuesReadOnceFromTheOldDevice) {
  Replace(LagCaseOf("Spa9600", Queries::many, Proof::answered));
}

INSTANTIATE_TEST_SUITE_P(OrderCases, AnotherDevice,
                         ::testing::Values(Exchanged{500ms, 2s}, Exchanged{1500ms, 2s},
                                           Exchanged{2500ms, 2s}, Exchanged{4500ms, 2s},
                                           Exchanged{3s, 5s}),
                         [](const auto& info) {
                           return std::to_string(info.param.off / 1ms) + "msOffPolledEvery" +
                                  FormatDuration(info.param.poll);
                         });

class ConfirmedWrite : public ::testing::TestWithParam<LagCase> {};

/// After the write the device restarts, as after a change of a parameter, and is silent for 1.4 s.
TEST_P(ConfirmedWrite, IsNotFollowedByTheOldValueAsGood) {
  LagRig rig(GetParam(), 1, [](config::Line& line) {
    for (config::Device& device : line.devices) device.poll = 1s;
  });
  rig.silent_after_write = 1400ms;
  rig.Open();
  for (int round = 0; round < 100; ++round) {
    rig.RunFor(7300ms + round * 17ms);
    ASSERT_TRUE(rig.Write(0));
  }
  rig.RunFor(30s);
  EXPECT_GT(rig.confirmed(), 0U);
  EXPECT_EQ(rig.oracle().wrong(), 0U) << rig.oracle().what();
}

INSTANTIATE_TEST_SUITE_P(
    OrderCases, ConfirmedWrite,
    ::testing::Values(LagCaseOf("ModbusRtu19200", Queries::many, Proof::answered),
                      LagCaseOf("ModbusAscii9600", Queries::many, Proof::silent),
                      LagCaseOf("Spa9600", Queries::many, Proof::answered)),
    LagCaseName);

/// Module 0 answers a request and its retry late, within the ceiling (679 ms), with as many values
/// as its neighbour has. No answer must become a value of the neighbour.
void AnswerLate(LagRig& rig, Duration first, Duration retry) {
  auto late = std::make_shared<std::deque<Duration>>();
  rig->server = [&rig, late](View request, Bytes reply, Instant end) {
    auto pieces = rig.server().OnRequest(request, std::move(reply), end);
    if (!AsText(request).starts_with("#01") || late->empty() || pieces.empty()) return pieces;
    pieces.front().after = late->front();
    late->pop_front();
    return pieces;
  };
  for (int round = 0; round < 5; ++round) {
    *late = {first, retry};
    rig.RunFor(10s + round * 137ms);
  }
}

TEST(OrderCases, ARetryAnsweredLaterThanItsFirstTryGivesNoWrongValue) {
  for (Duration first = 310ms; first <= 670ms; first += 20ms) {
    for (Duration retry = first; retry <= 670ms; retry += 20ms) {
      LagRig rig(LagCaseOf("Dcon9600", Queries::one, Proof::answered), 1, [](config::Line& line) {
        for (config::Device& device : line.devices) device.poll = 1s;
      });
      rig.Open();
      AnswerLate(rig, first, retry);
      EXPECT_EQ(rig.oracle().wrong(), 0U) << "late by " << FormatDuration(first) << " and "
                                          << FormatDuration(retry) << ": " << rig.oracle().what();
    }
  }
}

class NamedNeighbour : public ::testing::TestWithParam<Setup> {};

TEST_P(NamedNeighbour, IsServedDuringIgnoredWrites) {
  LagRig rig({GetParam(), Queries::many, Proof::answered}, 1, [](config::Line& line) {
    for (config::Device& device : line.devices) device.poll = 100ms;
    for (config::Point& point : line.devices[1].points) point.group = config::Group::fast;
    line.devices[1].points.resize(4);
  });
  rig->server = [&](View request, Bytes reply, Instant end) {
    const bool text = GetParam().protocol->name == "spabus";
    const bool write = text ? AsText(request).find('W') != std::string_view::npos
                            : request.size() > 1 && request[1] == 0x10;
    if (write) reply.clear();
    return rig.server().OnRequest(request, std::move(reply), end);
  };
  rig.Open();
  const config::Timing times = GetParam().protocol->timing(GetParam().serial);
  Duration oldest{};
  for (int tenth = 0; tenth < 600; ++tenth) {
    rig.Write(0);
    rig.RunFor(100ms);
    oldest = std::max(oldest, rig->AgeOf(1, 0).value_or(1h));
  }
  EXPECT_LT(oldest, 3 * (*times.reply + *times.drain) + 200ms)
      << "the neighbour's oldest value: " << oldest / 1ms << " ms";
  EXPECT_EQ(rig->StatusOf(1).Count(Outcome::no_reply), 0U);
}

INSTANTIATE_TEST_SUITE_P(OrderCases, NamedNeighbour,
                         ::testing::Values(RealLine("Spa9600"), RealLine("ModbusRtu19200")),
                         SetupName);

class EarlyDamage : public ::testing::TestWithParam<Setup> {};

/// On a pty or behind a network, a reply can arrive before the computed end of its request.
TEST_P(EarlyDamage, IsCountedAsCorruptAndNotAsNoReply) {
  LagRig rig({GetParam(), Queries::one, Proof::answered}, 1, OneDeviceEverySecond);
  rig->keeps_bit_rate = false;
  bool damages = false;
  rig->server = [&, count = std::size_t{0}](View, Bytes reply, Instant) mutable {
    if (damages && !reply.empty()) reply[++count % reply.size()] ^= 0x01;
    std::vector<tools::TimedPiece> pieces;
    if (!reply.empty()) pieces.push_back({-1ms, std::move(reply)});
    return pieces;
  };
  rig.Open();
  damages = true;
  rig.RunFor(12s);
  const bus::DeviceStatus status = rig->StatusOf(0);
  EXPECT_EQ(status.Count(Outcome::no_reply), 0U);
  EXPECT_GT(status.Count(Outcome::corrupt) + status.Count(Outcome::unexpected), 5U);
}

INSTANTIATE_TEST_SUITE_P(OrderCases, EarlyDamage, ::testing::ValuesIn(RealLines()), SetupName);

struct BehindBefore {
  LagCase which;
  std::size_t behind;
};

void PrintTo(const BehindBefore& before, std::ostream* out) {
  *out << before.which.name() << ", " << before.behind << " behind";
}

class Predecessor : public ::testing::TestWithParam<BehindBefore> {};

TEST_P(Predecessor, LeavesNoReplyThatIsAccepted) {
  const BehindBefore& before = GetParam();
  LagRig rig(before.which, 1, [](config::Line& line) {
    line.devices.resize(1);
    line.devices[0].poll = 1s;
  });
  rig.Open();
  rig.server().faults.behind = before.behind;
  for (int start = 0; start < 5; ++start) {
    rig.RunFor(20s + start * 300ms);
    rig.line().Restart();
  }
  rig.RunFor(2min);
  EXPECT_EQ(rig.oracle().wrong(), 0U) << rig.oracle().what();
}

std::vector<BehindBefore> Predecessors() {
  std::vector<BehindBefore> all;
  for (const LagCase& which : LagCases()) {
    if (!which.CanProve()) continue;
    for (const std::size_t behind : {1U, 2U, 3U}) all.push_back({which, behind});
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(OrderCases, Predecessor, ::testing::ValuesIn(Predecessors()),
                         [](const auto& info) {
                           return info.param.which.name() + std::to_string(info.param.behind) +
                                  "Behind";
                         });

// ---------------- Late replies are used if they end before the ceiling. After the ceiling, they
// must not make a wrong value good.

class LateReplies : public ::testing::TestWithParam<LagCase> {
 protected:
  /// Returns the share of good readings if every `nth` reply takes the time `think`.
  double Share(unsigned nth, Duration think) {
    LagRig rig(GetParam(), 1, [](config::Line& line) {
      line.timing.reply = kReply;
      line.devices.resize(1);
      line.devices[0].poll = 1s;
    });
    unsigned count = 0;
    bool late = false;
    Instant free_at{};
    rig->server = [&](View request, Bytes reply, Instant end) {
      const bool is_late = late && !reply.empty() && ++count % nth == 0;
      auto pieces = rig.server().OnRequest(request, std::move(reply), end);
      if (pieces.empty()) return pieces;
      Duration& after = pieces.front().after;
      if (is_late) after = std::max(after, think);
      free_at = std::max(free_at, end + after);
      after = free_at - end;
      return pieces;
    };
    rig.Open();
    late = true;
    rig.RunFor(20s);
    rig.oracle().RestartAvailability();
    rig.RunFor(5min);
    EXPECT_EQ(rig.oracle().wrong(), 0U) << rig.oracle().what();
    return rig.oracle().Availability();
  }
  static constexpr Duration kReply = 300ms;
};

TEST_P(LateReplies, AreUsed) {
  const double third = Share(3, 450ms);
  const double tenth = Share(10, 450ms);
  std::printf("%-28s good: 1 in 3 late %.3f, 1 in 10 late %.3f\n", GetParam().name().c_str(), third,
              tenth);
  EXPECT_GE(third, 0.60);
  EXPECT_GE(tenth, 0.85);
}

/// The late replies begin in the middle between reply time and ceiling, so that they are complete
/// at the ceiling.
TEST_P(LateReplies, AreUsedUpToTheCeiling) {
  const config::Timing times = GetParam().setup.protocol->timing(GetParam().setup.serial);
  const Duration whole = *times.ceiling - *times.reply;
  EXPECT_GE(Share(3, kReply + whole / 2), 0.60);
}

TEST_P(LateReplies, BeyondTheCeilingAreNeverWrong) { Share(3, 5s); }

std::vector<LagCase> LateCases() {
  std::vector<LagCase> cases;
  for (const LagCase& one : LagCases()) {
    if (one.CanProve() && one.proof == Proof::answered) cases.push_back(one);
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Lines, LateReplies, ::testing::ValuesIn(LateCases()), LagCaseName);

enum class Failure : std::uint8_t { dead, refuses, corrupt, late, slow, misnamed };

std::string NameOf(Failure failure) {
  constexpr const char* kNames[] = {"Dead", "Refuses", "Corrupt", "Late", "Slow", "Misnamed"};
  return kNames[static_cast<std::size_t>(failure)];
}

Bytes RefusalOf(const Protocol& protocol, View request, const std::string& address) {
  if (protocol.name == "spabus") {
    const std::string said = "<" + address + "N:6:";
    std::uint8_t sum = 0;
    for (const char c : said) sum ^= static_cast<std::uint8_t>(c);
    return ToBytes(said + HexByte(sum) + "\r\n");
  }
  Bytes reply = {static_cast<std::uint8_t>(std::stoi(address)),
                 static_cast<std::uint8_t>(request[1] | 0x80U), 0x02};
  const std::uint16_t crc = Crc16(reply);
  reply.push_back(static_cast<std::uint8_t>(crc & 0xFFU));
  reply.push_back(static_cast<std::uint8_t>(crc >> 8U));
  return reply;
}

class Neighbour : public ::testing::TestWithParam<std::tuple<std::string, Failure>> {};

TEST_P(Neighbour, KeepsItsPolls) {
  const auto& [name, failure] = GetParam();
  const auto& setup = RealLine(name);
  Rig rig(setup, [](config::Line& line) {
    for (config::Device& device : line.devices) device.poll = 1s;
    auto& points = line.devices[1].points;
    points.resize(std::min<std::size_t>(points.size(), 8));
  });
  VirtualLine::WireTwin& bad = rig->twin(0);
  const Duration reply = *setup.protocol->timing(setup.serial).reply;
  const Duration ceiling = *setup.protocol->timing(setup.serial).ceiling;
  switch (failure) {
    case Failure::dead:
      bad.manner.dead = true;
      break;
    case Failure::refuses:
      bad.manner.instead = [&](View request) {
        return RefusalOf(*setup.protocol, request, rig->config().lines[0].devices[0].address);
      };
      break;
    case Failure::misnamed:
      bad.manner.instead = [&](View request) {
        return RefusalOf(*setup.protocol, request, rig->config().lines[0].devices[1].address);
      };
      break;
    case Failure::corrupt:
      bad.manner.distort = [](Bytes bytes) {
        bytes[bytes.size() / 2] ^= 0x01;
        return bytes;
      };
      break;
    case Failure::late:
      bad.manner.think = ceiling + 200ms;
      break;
    case Failure::slow:
      bad.manner.think = reply - 20ms;
      break;
  }
  rig->Open();
  constexpr Duration kTime = 3min;
  std::size_t reads = 0;
  rig->read = [&](std::uint32_t device, Instant) { reads += device == 1 ? 1 : 0; };
  rig->RunFor(kTime);
  const double missed = rig->StatusOf(1).missed;
  const double share = 1 - missed / (kTime / 1s);
  std::printf("%-16s %-8s neighbour has %.3f of its polls, %zu reads\n", name.c_str(),
              NameOf(failure).c_str(), share, reads);
  EXPECT_GE(share, 0.95);
}

INSTANTIATE_TEST_SUITE_P(
    Failures, Neighbour,
    ::testing::Combine(::testing::Values("Spa9600", "ModbusRtu19200"),
                       ::testing::Values(Failure::dead, Failure::refuses, Failure::corrupt,
                                         Failure::late, Failure::slow, Failure::misnamed)),
    [](const auto& info) { return std::get<0>(info.param) + NameOf(std::get<1>(info.param)); });

}  // namespace
}  // namespace baudgate::protocols
