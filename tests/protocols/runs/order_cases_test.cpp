// Seven ways in which a reply was taken for what it is not, each as it was seen from outside, with
// default times: what must not happen any more.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <deque>
#include <functional>
#include <memory>
#include <random>
#include <utility>

#include "gateway/bus/poller/poller.h"
#include "tests/protocols/runs/lag_rig.h"
#include "tests/support/long_run.h"

namespace baudgate {
namespace {

/// What goes wrong depends on the moment: a tenth of these in ctest.
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

// ---------------------------------------------------------------- 1: two points exchanged

/// A slave that is silent to function 08, and two blocks of one register. A server holds one reply
/// back once and from then on answers each request with the reply to the one before.
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

// ---------------------------------------------------------------- 2: an old value, a young age

struct LateByCount {
  LagCase which;
  std::size_t behind;
  Duration poll;
};

void PrintTo(const LateByCount& late, std::ostream* out) {
  *out << late.which.name() << ", " << late.behind << " behind";
}

class OneQuery : public ::testing::TestWithParam<LateByCount> {};

/// One query, which is asked again and again: the reply to an earlier one is whole, good, and from
/// the right point.
TEST_P(OneQuery, ShowsNoOldValueUnderAYoungAge) {
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

// ---------------------------------------------------------------- 3: another meter

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

/// `serial_number` is configured. The channel is not open at the new meter: it says so (status 05).
TEST_P(AnotherDevice, IsNeverBelievedInSpiteOfTheSerialNumber) {
  Replace(LagCaseOf("Set4tm9600", Queries::many, Proof::answered));
}

/// Points of group `once` of the relay that was replaced beside values of the new one.
TEST_P(AnotherDevice, NeverStandsBesideWhatWasReadOnceOfTheOldOne) {
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

// ---------------------------------------------------------------- 4: a write, then silence

class ConfirmedWrite : public ::testing::TestWithParam<LagCase> {};

/// The device confirms and restarts, as devices do after a parameter: 1.4 s of silence, and the
/// value is not read back.
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

// ---------------------------------------------------------------- 5: two tries, both late

/// Module 0 answers a first try and its retry so late, both within the ceiling (679 ms), and with
/// the same number of values as its neighbour: neither answer may become the neighbour's value.
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

TEST(OrderCases, ARetryMayBeAnsweredLaterThanItsFirstTry) {
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

// ---------------------------------------------------------------- 6: neighbours

class NamedNeighbour : public ::testing::TestWithParam<Setup> {};

/// A client writes without a pause to a point whose writes the device ignores. Replies carry the
/// address: the neighbour may wait for the tries of a write, but not for what might follow them.
TEST_P(NamedNeighbour, DoesNotStarveBesideWritesThatAreIgnored) {
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

// ---------------------------------------------------------------- 7: damage

class EarlyDamage : public ::testing::TestWithParam<Setup> {};

/// On a pty or behind a network a reply may come before the request can have been sent. A damaged
/// one is damage, not silence.
TEST_P(EarlyDamage, IsCorruptAndNoSilence) {
  LagRig rig({GetParam(), Queries::one, Proof::answered}, 1, OneDeviceEverySecond);
  rig->keeps_bit_rate = false;
  bool damages = false;
  rig->server = [&, count = std::size_t{0}](View, Bytes reply, Instant) mutable {
    if (damages && !reply.empty()) reply[++count % reply.size()] ^= 0x01;
    std::vector<TimedPiece> pieces;
    if (!reply.empty()) pieces.push_back({-1ms, std::move(reply)});
    return pieces;
  };
  rig.Open();
  damages = true;
  rig.RunFor(12s);
  const DeviceStatus status = rig->StatusOf(0);
  EXPECT_EQ(status.Count(Outcome::no_reply), 0U);
  EXPECT_GT(status.Count(Outcome::corrupt) + status.Count(Outcome::unexpected), 5U);
}

INSTANTIATE_TEST_SUITE_P(OrderCases, EarlyDamage, ::testing::ValuesIn(RealLines()), SetupName);

// ---------------------------------------------------------------- owed to somebody else

struct BehindBefore {
  LagCase which;
  std::size_t behind;
};

void PrintTo(const BehindBefore& before, std::ostream* out) {
  *out << before.which.name() << ", " << before.behind << " behind";
}

class Predecessor : public ::testing::TestWithParam<BehindBefore> {};

/// A server that is behind goes on while the program is started again: what it owes answers
/// requests of which nobody knows any more.
TEST_P(Predecessor, LeavesNoReplyThatIsBelieved) {
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

}  // namespace
}  // namespace baudgate
