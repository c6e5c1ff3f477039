// Tests `baudgate decode` with the output of `baudgate trace` and the files of the flight recorder.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class Traces : public Station {
 protected:
  std::vector<Json> Decode(std::vector<std::string> words, const std::string& trace) const {
    words.insert(words.begin(), "decode");
    words.push_back(Write("saved.trace", trace).string());
    const Finished decode = Command(words);
    EXPECT_EQ(decode.code, 0) << decode.errors;
    return JsonLines(decode.output);
  }
};

TEST_F(Traces, AreDecodedLikeCaptures) {
  const auto exchanges = Decode({"--protocol", "dcon"}, R"(# baudgate 1.0
04:05:06.000000 - # port open: serial
04:05:06.000500 - < 41 | A
04:05:06.123456 ai-1 > 23 30 31 0D | #01.
04:05:06.140000 ai-1 < 3E 2B | >+
04:05:06.140100 ai-1 < 30 31 2E 35 30 30 0D | 01.500.
04:05:06.140300 ai-1 = ok, 16.8 ms
04:05:06.150000 - < 3E 39 | >9
04:05:07.000000 ai-2 > 23 30 32 0D | #02.
04:05:08.000000 ai-2 = no_reply
04:05:08.000001 ai-2 # offline: no_reply
)");
  ASSERT_EQ(exchanges.size(), 2U);
  ASSERT_EQ(exchanges[0]["outcome"], "ok") << exchanges[0];
  EXPECT_EQ(exchanges[0]["values"][0]["value"], 1.5);
  EXPECT_EQ(exchanges[0]["time"], "04:05:06.123456");
  EXPECT_EQ(exchanges[0]["device"], "ai-1");
  EXPECT_EQ(exchanges[1]["outcome"], "no_reply");
}

TEST_F(Traces, CanBeDecodedForOneDevice) {
  const std::string trace =
      "04:05:06.123456 ai-1 > 23 30 31 0D | #01.\n04:05:06.223456 ai-2 > 23 30 32 0D | #02.\n"
      "04:05:06.323456 ai-2 < 3E 2B 30 31 2E 30 30 30 0D | >+01.000.\n";
  const auto exchanges = Decode({"--protocol", "dcon", "--device", "ai-2"}, trace);
  ASSERT_EQ(exchanges.size(), 1U);
  EXPECT_EQ(exchanges[0]["device"], "ai-2");
  ASSERT_EQ(exchanges[0]["outcome"], "ok") << exchanges[0];
  EXPECT_EQ(exchanges[0]["values"][0]["value"], 1.0);
}

/// The outcomes are those of the trace. The bytes do not show that an exchange exceeded the
/// ceiling, or that a reply was late.
TEST_F(Traces, KeepTheRecordedOutcomes) {
  const auto exchanges = Decode({"--protocol", "dcon"}, R"(
04:05:06.000000 ai-1 > 23 30 31 0D | #01.
04:05:06.010000 ai-1 < 3E 2B 30 31 | >+01
04:05:07.000000 ai-1 = corrupt: the device kept sending for longer than | an exchange may last
04:05:07.000000 - # … 184 more bytes
04:05:08.000000 ai-1 > 23 30 31 0D | #01.
04:05:08.010000 ai-1 < 3E 2B 30 31 2E 35 30 30 0D | >+01.500.
04:05:08.010100 ai-1 = unexpected, 10.1 ms: the reply belongs to another request
04:05:09.000000 ai-1 > 23 30 31 0D | #01.
04:05:09.010000 ai-1 < 3E 2B 30 31 2E 35 30 30 0D | >+01.500.
04:05:09.010100 ai-2 = no_reply
04:05:09.010100 ai-1 = ok, 10.1 ms
04:05:09.010200 ai-1 = no_reply
04:05:10.000000 ai-1 > 23 30 31 0D | #01.
04:05:10.010000 ai-1 < 3F 30 31 0D | ?01.
04:05:10.010100 ai-1 = ok, 10.1 ms
04:05:11.000000 ai-1 > 23 2A 2A 0D | #**.
04:05:11.005000 ai-1 = ok
)");
  ASSERT_EQ(exchanges.size(), 5U);
  const struct {
    std::string outcome;
    std::string reason;
    std::size_t values;
  } rows[] = {
      {"corrupt",
       "the device kept sending for longer than | an exchange may last; these bytes and options "
       "alone would mean: partial (stopped mid-frame)",
       0},
      {"unexpected",
       "the reply belongs to another request; these bytes and options alone would mean: ok", 0},
      {"ok", "", 1},
      {"ok",
       "the recorded outcome is shown; these bytes and options alone would mean: unsupported (the "
       "module answers '?01' to #: the module does not have this command or channel, or the "
       "channel "
       "is disabled)",
       0},
      {"ok", "", 0},
  };
  for (std::size_t i = 0; i < exchanges.size(); ++i) {
    EXPECT_EQ(exchanges[i]["outcome"], rows[i].outcome) << i;
    EXPECT_EQ(exchanges[i]["reason"], rows[i].reason) << i;
    EXPECT_EQ(exchanges[i]["values"].size(), rows[i].values) << i;
  }
}

TEST_F(Traces, MayEndBeforeAnExchangeEnds) {
  const auto exchanges = Decode({"--protocol", "dcon"}, R"(
04:05:06.000000 ai-1 > 23 30 31 0D | #01.
04:05:06.000100 - # port released
04:05:07.000000 ai-1 > 23 30 31 0D | #01.
04:05:07.010000 ai-1 < 3E 2B 30 31 | >+01
04:05:08.000000 ai-1 > 23 30 31 0D | #01.
04:05:08.010000 ai-1 < 3E 2B 30 31 2E 35 30 30 0D | >+01.500.
04:05:09.000000 ai-1 > 23 30 31 0D | #01.
04:05:09.010000 ai-1 < 3E 2B 30 31 | >+01
)");
  ASSERT_EQ(exchanges.size(), 4U);
  const std::string unknown = "the recording does not show how this exchange ended";
  const std::string ends = "the recording ends before this exchange";
  const std::string rows[][2] = {{"none", unknown}, {"none", unknown}, {"ok", ""}, {"none", ends}};
  for (std::size_t i = 0; i < exchanges.size(); ++i) {
    EXPECT_EQ(exchanges[i]["outcome"], rows[i][0]) << i;
    EXPECT_EQ(exchanges[i]["reason"], rows[i][1]) << i;
  }
  const auto captured = Decode({"--protocol", "dcon"}, "> 23 30 31 0D\n");
  ASSERT_EQ(captured.size(), 1U);
  EXPECT_EQ(captured[0]["outcome"], "no_reply") << "a capture is as it is";
}

TEST_F(Traces, MaskedBytesAreNoErrors) {
  const auto meter = Decode({"--protocol", "set4tm"}, R"(
04:05:06.000000 m > 05 01 ** ** ** ** ** ** ** ** | ..********
04:05:06.010000 m < 05 03 42 E1 | ..B.
04:05:06.010100 m = refused, 10.0 ms
04:05:07.000000 m > 05 01 ** ** ** ** ** ** ** ** | ..********
04:05:07.010000 m < 05 03 42 E1 | ..B.
04:05:08.000000 m > 05 01 ** ** ** ** ** ** ** ** | ..********
04:05:08.010000 m < 05 01 ** ** ** ** ** ** ** ** | ..********
04:05:08.010100 m = unexpected, 10.0 ms
04:05:09.000000 m > 05 01 ** ** ** ** ** ** ** ** | ..********
)");
  ASSERT_EQ(meter.size(), 4U);
  const char* const outcomes[] = {"refused", "none", "unexpected", "none"};
  const char* const reasons[] = {"masked", "masked", "masked", "recording ends"};
  for (std::size_t i = 0; i < meter.size(); ++i) {
    EXPECT_EQ(meter[i]["outcome"], outcomes[i]) << i;
    EXPECT_THAT(meter[i]["reason"].get<std::string>(), HasSubstr(reasons[i])) << i;
    EXPECT_THAT(meter[i]["reason"].get<std::string>(), Not(HasSubstr("rong"))) << i;
    EXPECT_THAT(meter[i]["values"], IsEmpty()) << i;
  }
  const auto relay = Decode({"--protocol", "spabus"}, R"(
> 3E 31 57 56 31 36 30 3A ** ** ** 3A ** ** 0D
< 0A 3C 31 41 3A 37 36 0D 0A
)");
  ASSERT_EQ(relay.size(), 1U);
  EXPECT_EQ(relay[0]["outcome"], "ok") << relay[0]["reason"];
  EXPECT_THAT(relay[0]["reason"].get<std::string>(), HasSubstr("masked"));
}

TEST_F(Traces, WithBadHexAreRefused) {
  const std::string file =
      Write("bad.trace", "04:05:06.123456 ai-1 > 23 3* 31 0D | #01.\n").string();
  const Finished decode = Command({"decode", "--protocol", "dcon", file});
  EXPECT_EQ(decode.code, 2);
  EXPECT_THAT(decode.errors, HasSubstr("line 1"));
}

}  // namespace
}  // namespace baudgate::system_test
