// Tests totals of counters: roll-overs, cleared counters, restarts of the module and of the
// program. Bytes: dcon reference, chapter 9 and the table of chapter 11 ($AA5).
// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/dcon/support.h"

namespace baudgate::protocols::dcon {
namespace {

using config::Type;

config::Device Counter(const std::string& read = "#0 total", const Settable& options = {}) {
  return MakeDevice({ReadPoint("total", read, Type::uint64)}, options);
}

class DconTotals : public ::testing::Test {
 protected:
  Answer Poll(const std::vector<std::pair<std::string, std::string>>& lines) {
    talk_.now += 1s;
    Answer answer;
    answer.then = Then::ask_again;
    for (const auto& [request, reply] : lines) {
      EXPECT_EQ(answer.then, Then::ask_again) << "before " << request;
      EXPECT_EQ(Asked(talk_, baudgate::Poll(0)), request + "\r");
      answer = Exchange(talk_, baudgate::Poll(0), reply.empty() ? "" : reply + "\r");
    }
    EXPECT_EQ(answer.then, Then::done);
    return answer;
  }
  static std::uint64_t TotalIn(const Answer& answer) {
    if (answer.readings.size() != 1 || !IsGood(answer.readings[0].quality)) return 999;
    return std::get<std::uint64_t>(answer.readings[0].value);
  }
  void Begin(const std::string& count) {
    Poll({{"$015", "!011"}, {"#010", ">" + count}, {"#010", ">" + count}});
  }

  Talk talk_{DconProtocol(), Counter()};
};

TEST_F(DconTotals, BeginWithTheValueOfTheCounter) {
  EXPECT_EQ(TotalIn(Poll({{"$015", "!011"}, {"#010", ">0001E240"}, {"#010", ">0001E240"}})),
            123456U);
  EXPECT_EQ(TotalIn(Poll({{"#010", ">0001E250"}, {"#010", ">0001E250"}})), 123472U);
  EXPECT_EQ(TotalIn(Poll({{"#010", ">0001E250"}})), 123472U) << "nothing to confirm";
}

TEST_F(DconTotals, ContinueOverARollOver) {
  Begin("FFFFFFF0");
  const Answer answer = Poll({{"#010", ">00000010"}, {"$015", "!010"}, {"#010", ">00000011"}});
  EXPECT_EQ(TotalIn(answer), 0x1'0000'0010U);
  EXPECT_EQ(TotalIn(Poll({{"#010", ">00000012"}, {"#010", ">00000012"}})), 0x1'0000'0012U);
}

TEST_F(DconTotals, AClearedCounterAddsNothing) {
  Begin("00001000");
  EXPECT_EQ(TotalIn(Poll({{"#010", ">00000005"}, {"$015", "!010"}, {"#010", ">00000006"}})),
            0x1000U);
  EXPECT_EQ(TotalIn(Poll({{"#010", ">00000009"}, {"#010", ">0000000A"}})), 0x1004U);
}

TEST_F(DconTotals, ARestartedModuleAddsNothing) {
  Begin("FFFFFFF0");
  EXPECT_EQ(
      TotalIn(Poll(
          {{"#010", ">00000005"}, {"$015", "!011"}, {"#010", ">00000006"}, {"#010", ">00000006"}})),
      0xFFFF'FFF0U)
      << "near the end as well";
  talk_->OnReconnect();
  EXPECT_EQ(TotalIn(Poll({{"$015", "!011"}, {"#010", ">00000900"}, {"#010", ">00000900"}})),
            0xFFFF'FFF0U)
      << "however far it has come by now";
  talk_->OnReconnect();
  EXPECT_EQ(TotalIn(Poll({{"$015", "!010"}, {"#010", ">00000910"}, {"#010", ">00000910"}})),
            0x1'0000'0000U)
      << "only the line was gone";
}

TEST_F(DconTotals, ADamagedCountChangesNothing) {
  Begin("00001000");
  EXPECT_EQ(
      TotalIn(Poll(
          {{"#010", ">80001001"}, {"$015", "!010"}, {"#010", ">00001002"}, {"#010", ">00001002"}})),
      0x1002U);
  EXPECT_EQ(
      TotalIn(Poll(
          {{"#010", ">00000002"}, {"$015", "!010"}, {"#010", ">00001003"}, {"#010", ">00001003"}})),
      0x1003U);
  const Answer thrice = Poll({{"#010", ">80001001"},
                              {"$015", "!010"},
                              {"#010", ">40001001"},
                              {"$015", "!010"},
                              {"#010", ">20001001"}});
  EXPECT_TRUE(thrice.readings.empty());
  EXPECT_EQ(TotalIn(Poll({{"$015", "!010"}, {"#010", ">00001004"}, {"#010", ">00001004"}})),
            0x1004U);
}

/// >00112345 and >00122344 have the same checksum, so damage can turn one into the other.
TEST_F(DconTotals, AnIncreaseMustBeConfirmed) {
  Begin("00112345");
  EXPECT_EQ(TotalIn(Poll({{"#010", ">00122344"}, {"#010", ">00112346"}, {"#010", ">00112347"}})),
            0x112346U);
  EXPECT_EQ(TotalIn(Poll({{"#010", ">00112348"}, {"#010", ">00122344"}})), 0x112348U)
      << "the second one is damaged";
  EXPECT_EQ(TotalIn(Poll({{"#010", ">00112349"}, {"#010", ">00112349"}})), 0x112349U);
}

TEST_F(DconTotals, ADamagedFirstCountIsIgnored) {
  EXPECT_EQ(
      TotalIn(Poll(
          {{"$015", "!011"}, {"#010", ">00122344"}, {"#010", ">00112345"}, {"#010", ">00112345"}})),
      0x112345U);
}

TEST_F(DconTotals, AModuleOfUnknownRestartStateAddsNothing) {
  Poll({{"$015", ""}, {"$015", ""}, {"#010", ">00001000"}, {"#010", ">00001000"}});
  EXPECT_EQ(TotalIn(Poll({{"#010", ">00000005"}, {"#010", ">00000006"}})), 0x1000U);
}

TEST_F(DconTotals, AreKeptOverARestartOfTheProgram) {
  EXPECT_EQ(talk_->Memory(), "");
  Begin("FFFFFFF0");
  EXPECT_EQ(talk_->Memory(), "#0 4294967280 4294967280");
  Poll({{"#010", ">00000010"}, {"$015", "!010"}, {"#010", ">00000010"}});
  EXPECT_EQ(talk_->Memory(), "#0 4294967280 4294967280") << "at most once a minute";
  talk_.now += 1min;
  Poll({{"#010", ">00000020"}, {"#010", ">00000020"}});
  EXPECT_EQ(talk_->Memory(), "#0 16 4294967312") << "what was confirmed by then";

  Talk next(DconProtocol(), Counter());
  next->Recall("#0 32 4294967328", {next.now, {}});
  EXPECT_EQ(next->Memory(), "#0 32 4294967328");
  Asked(next, baudgate::Poll(0));
  Exchange(next, baudgate::Poll(0), "!010\r");
  Asked(next, baudgate::Poll(0));
  Exchange(next, baudgate::Poll(0), ">00000120\r");
  Asked(next, baudgate::Poll(0));
  EXPECT_EQ(TotalIn(Exchange(next, baudgate::Poll(0), ">00000120\r")), 0x1'0000'0120U)
      << "and what was counted meanwhile";
}

TEST_F(DconTotals, InvalidStoredTextIsIgnored) {
  for (const char* text : {"serial 5", "#0", "#0 x 5", "#1 5 5", "#0 4294967296 5", ";;"}) {
    Talk talk(DconProtocol(), Counter());
    talk->Recall(text, {talk.now, {}});
    Asked(talk, baudgate::Poll(0));
    Exchange(talk, baudgate::Poll(0), "!010\r");
    Asked(talk, baudgate::Poll(0));
    Exchange(talk, baudgate::Poll(0), ">00000020\r");
    Asked(talk, baudgate::Poll(0));
    EXPECT_EQ(TotalIn(Exchange(talk, baudgate::Poll(0), ">00000020\r")), 32U) << text;
  }
}

TEST(DconTotalsOf, DecimalCountersHaveSixteenBits) {
  Talk talk(DconProtocol(), Counter("#2 decimal total"));
  const auto say = [&](const std::string& reply) {
    talk.now += 1s;
    Asked(talk, Poll(0));
    return Exchange(talk, Poll(0), reply + "\r");
  };
  say("!010");
  say("!0165530");
  say("!0165530");
  say("!0100010");
  say("!010");
  const Answer answer = say("!0100010");
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(answer.readings[0].value, Value(std::uint64_t{65546}));
}

TEST(DconTotalsOf, ACounterIsClearedByAWriteOnly) {
  config::Point clear = WritePoint("clear", "", "$60{clear}", Type::boolean);
  const config::Device device = MakeDevice({ReadPoint("total", "#0 total", Type::uint64), clear});
  FixedValues values;
  values.values[0] = std::uint64_t{0xFFFF'FFF0};
  const auto twin = DconProtocol().make_twin(device, values);
  Talk talk(DconProtocol(), device);
  EXPECT_EQ(talk.Run(Poll(0), *twin).readings.size(), 1U);
  EXPECT_EQ(talk.Run(Write(1, true), *twin).outcome, Outcome::ok);
  EXPECT_EQ(AsText(talk.asked.back()), "$0160\r");
  EXPECT_EQ(values.values[0], Value(std::uint64_t{0}));
  const Answer answer = talk.Run(Poll(0), *twin);
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(answer.readings[0].value, Value(std::uint64_t{0xFFFF'FFF0})) << "no roll-over";
  EXPECT_EQ(talk.Run(Write(1, false), *twin).outcome, Outcome::unsupported);
}

TEST(DconTotalsOf, FrequencyModulesAreRefused) {
  Talk talk(DconProtocol(), Counter("#0 total", {{"identify", true}}));
  Asked(talk, Poll(0));
  Exchange(talk, Poll(0), "!017080\r");
  Asked(talk, Poll(0));
  Exchange(talk, Poll(0), "!01510600\r");
  EXPECT_NE(
      talk->trouble().text.find("type 51 measures in Hz, but the profile has a total for total"),
      std::string::npos)
      << talk->trouble().text;
}

TEST(DconTotalsOf, PointsAreConfigured) {
  const auto check = [](const std::string& read, Type type) {
    return static_cast<bool>(CheckPoint(ReadPoint("a", read, type)));
  };
  EXPECT_TRUE(check("#0 total", Type::uint64));
  EXPECT_TRUE(check("#0 decimal total", Type::float64));
  EXPECT_FALSE(check("#0 total", Type::uint32));
  EXPECT_FALSE(check("$30 total", Type::uint64));
  EXPECT_FALSE(check("# total", Type::uint64));
  EXPECT_TRUE(check("$70 power_on", Type::float32));
  EXPECT_FALSE(check("$70", Type::float32));
  EXPECT_TRUE(check("~40", Type::float32));
  EXPECT_TRUE(check("~4", Type::uint16));
  EXPECT_TRUE(check("~4S", Type::uint16));
  const auto writes = [](const std::string& write) {
    return static_cast<bool>(CheckPoint(WritePoint("a", "", write, Type::boolean)));
  };
  EXPECT_TRUE(writes("$C{clear}"));
  EXPECT_TRUE(writes("$C3{clear}"));
  EXPECT_FALSE(writes("$7{clear}"));
  EXPECT_FALSE(writes("#0{clear}"));
}

TEST(DconOutputs, SafeAndPowerUpValuesAreDecoded) {
  const auto one = [](const std::string& read, Type type, const std::string& reply) {
    Talk talk(DconProtocol(), MakeDevice({ReadPoint("a", read, type)}));
    Asked(talk, Poll(0));
    return Exchange(talk, Poll(0), reply + "\r");
  };
  Answer answer = one("$70 power_on", Type::float32, "!01+02.500");
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(answer.readings[0].value, Value{2.5});
  EXPECT_EQ(one("~40", Type::float32, "!01+01.250").readings[0].value, Value{1.25});
  EXPECT_EQ(one("~4", Type::uint16, "!010F03").readings[0].value, Value(std::uint64_t{0x0F03}));
  EXPECT_EQ(one("~4S", Type::uint16, "!01FF").readings[0].value, Value(std::uint64_t{0xFF}));
}

}  // namespace
}  // namespace baudgate::protocols::dcon
