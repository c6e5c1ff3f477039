// Every routed write leaves its record, whatever becomes of it; nothing waits for that.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/gateway/outputs/modbus/service/service_fixture.h"
#include "tests/gateway/records/audit/remembering_log.h"

namespace baudgate::modbus {
namespace {

using testing::ElementsAre;

constexpr const char* kWrite = "06 00 08 00 07";

class RoutedWriteTest : public ServiceTest {
 protected:
  RoutedWriteTest() {
    links_.writes = &log_;
    Add(1, 20, 29);
  }
  std::vector<std::string> Noted() const {
    std::vector<std::string> all;
    for (const audit::WriteRecord& record : log_.noted) {
      all.push_back(record.client + " " + record.line + " " + record.device + " " + record.point +
                    " " + ToText(record.value) + " " + std::string(audit::OutcomeOf(record)));
    }
    return all;
  }
  audit::RememberingLog log_;
};

TEST_F(RoutedWriteTest, IsRecordedBehindItsExchange) {
  Ask(21, kWrite);
  EXPECT_TRUE(log_.noted.empty());
  drive_.Wait(0).done(GoodReply(kWrite));
  EXPECT_THAT(Noted(), ElementsAre("10.0.0.7:40112 drive unit 21 06 holding 8 7 ok"));
  EXPECT_EQ(Settle().size(), 1U);
  EXPECT_TRUE(log_.begun.empty() && log_.waited.empty()) << "it waits for nothing";
}

TEST_F(RoutedWriteTest, ReadsAreNot) {
  Ask(21, "03 00 00 00 01");
  drive_.Wait(0).done(GoodReply("03 02 00 00"));
  Ask(21, "2B 0E 01 00");
  EXPECT_TRUE(log_.noted.empty());
}

TEST_F(RoutedWriteTest, RefusalsAndSilenceAreWhatTheyAre) {
  Ask(21, kWrite);
  drive_.Wait(0).done(SlaveException("86 02"));
  Ask(21, kWrite);
  drive_.Wait(1).done(Trouble(Outcome::no_reply, "silence"));
  Ask(21, kWrite);
  drive_.Wait(2).done(Trouble(Outcome::line_down, "unplugged", false));
  EXPECT_THAT(Noted(), ElementsAre(testing::EndsWith("refused"), testing::EndsWith("unknown"),
                                   testing::EndsWith("not_sent")));
}

TEST_F(RoutedWriteTest, WhatIsNotLetInIsRecorded) {
  drive_.full = true;
  Ask(21, kWrite);
  listener().permit = config::Permit::read;
  Ask(21, kWrite);
  EXPECT_THAT(Noted(), ElementsAre(testing::EndsWith("busy"), testing::EndsWith("denied")));
  EXPECT_EQ(log_.noted[0].kind, audit::Kind::denied);
}

TEST_F(RoutedWriteTest, ABroadcastIsNeverConfirmed) {
  listener().broadcast = config::Listener::Broadcast::pass;
  Ask(0, kWrite);
  drive_.Wait(0).done(GoodReply(Bytes{}));
  EXPECT_THAT(Noted(), ElementsAre("10.0.0.7:40112 drive unit 0 06 holding 8 7 unknown"));
}

}  // namespace
}  // namespace baudgate::modbus
