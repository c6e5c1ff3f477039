// Tests of writes that the gate refuses, as Modbus exceptions, and of the select register.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/gateway/outputs/modbus/service/service_fixture.h"

namespace baudgate::modbus {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class WriteRules : public ServiceTest {
 protected:
  config::Writing& writing() { return config_.lines[0].devices[0].points[0].writing; }
  static constexpr const char* kSelect = "06 EA 60 C0 DE";
  static constexpr const char* kWrite = "06 00 00 00 07";
  static constexpr const char* kSelected = "12 34 00 00 00 06 01 06 EA 60 C0 DE";
};

TEST_F(WriteRules, ADeviceWithoutWritePermissionIsReadOnly) {
  writing().allowed = false;
  EXPECT_THAT(Ask(1, kWrite), ElementsAre("12 34 00 00 00 03 01 86 02"));
  EXPECT_THAT(sink_.commands, IsEmpty());
}

TEST_F(WriteRules, ADeniedWriteIsRecorded) {
  config_.lines[0].devices[0].points.push_back(MakePoint(config::Type::int16, 1));
  EXPECT_THAT(Ask(1, "06 00 01 00 07"), ElementsAre("12 34 00 00 00 03 01 86 02"));
  ASSERT_THAT(sink_.denied, SizeIs(1));
  EXPECT_EQ(sink_.denied[0].reason, "'p1' can only be read");
  listener().permit = config::Permit::read;
  EXPECT_THAT(Ask(1, kWrite), ElementsAre("12 34 00 00 00 03 01 86 01"));
  ASSERT_THAT(sink_.denied, SizeIs(2));
  EXPECT_EQ(sink_.denied[1].client, "10.0.0.7:40112");
  EXPECT_EQ(sink_.denied[1].value, Value(std::int64_t{7}));
  EXPECT_EQ(
      sink_.denied[1].reason,
      "the listener does not permit this request; see its 'permit' and 'write' in modbus.listen");
}

TEST_F(WriteRules, AWriteBeyondTheClientLimitIsRecorded) {
  for (std::uint16_t i = 0; i < PendingRequests::kMost; ++i) {
    ASSERT_THAT(Ask(Frame(1, kWrite, i)), IsEmpty());
  }
  EXPECT_THAT(Ask(1, kWrite), ElementsAre("12 34 00 00 00 03 01 86 06"));
  EXPECT_THAT(Ask(1, kWrite), ElementsAre("12 34 00 00 00 03 01 86 06"));
  EXPECT_THAT(sink_.commands, SizeIs(PendingRequests::kMost));
  ASSERT_THAT(sink_.denied, SizeIs(2));
  EXPECT_EQ(sink_.denied[0].end, WriteEnd::busy);
  EXPECT_EQ(sink_.denied[0].client, "10.0.0.7:40112");
  EXPECT_EQ(sink_.denied[0].value, Value(std::int64_t{7}));
  EXPECT_EQ(sink_.denied[0].reason,
            "the request was not sent, because this client has 32 unanswered requests already");
}

TEST_F(WriteRules, AValueBeyondItsLimitsIsAnIllegalValue) {
  writing().max = 6;
  EXPECT_THAT(Ask(1, kWrite), ElementsAre("12 34 00 00 00 03 01 86 03"));
  EXPECT_THAT(sink_.commands, IsEmpty());
}

TEST_F(WriteRules, AWriteToALockedPointIsADeviceFailure) {
  writing().allow_when = {{"line.unit-1.p0", Value(std::int64_t{5}), Value(), 0, 0}};
  EXPECT_THAT(Ask(1, kWrite), ElementsAre("12 34 00 00 00 03 01 86 04")) << "it is -2";
  EXPECT_THAT(sink_.commands, IsEmpty());
}

TEST_F(WriteRules, ASelectedPointIsWritten) {
  writing().select = true;
  EXPECT_THAT(Ask(1, kWrite), ElementsAre("12 34 00 00 00 03 01 86 04"));
  EXPECT_THAT(Ask(1, kSelect), ElementsAre(kSelected));
  EXPECT_THAT(sink_.commands, IsEmpty()) << "a selection moves nothing";
  now_ += 9s;
  EXPECT_THAT(Ask(1, kWrite), IsEmpty()) << "waits for the device";
  EXPECT_THAT(sink_.commands, SizeIs(1));
  EXPECT_EQ(sink_.commands.at(0).client, "10.0.0.7:40112");
  EXPECT_THAT(Ask(1, kWrite), ElementsAre("12 34 00 00 00 03 01 86 04")) << "once";
}

TEST_F(WriteRules, ASelectionBelongsToItsConnection) {
  writing().select = true;
  KeptWire other_wire;
  Ask(1, kSelect);
  const auto other = Enter(other_wire);
  other->Handle(Frame(1, kWrite), Clocks());
  EXPECT_THAT(other_wire.Take(), ElementsAre("12 34 00 00 00 03 01 86 04"));
  EXPECT_THAT(sink_.commands, IsEmpty());
}

TEST_F(WriteRules, ASelectionExpires) {
  writing().select = true;
  writing().select_time = 2s;
  Ask(1, kSelect);
  now_ += 2s;
  EXPECT_THAT(Ask(1, kWrite), ElementsAre("12 34 00 00 00 03 01 86 04"));
}

TEST_F(WriteRules, TheSelectRegisterAcceptsOnlyTheKeyAndIsNotReadable) {
  writing().select = true;
  EXPECT_THAT(Ask(1, "06 EA 60 00 01"), ElementsAre("12 34 00 00 00 03 01 86 03"));
  EXPECT_THAT(Ask(1, "03 EA 60 00 01"), ElementsAre("12 34 00 00 00 03 01 83 02"));
  EXPECT_THAT(Ask(1, "06 EA 61 C0 DE"), ElementsAre("12 34 00 00 00 03 01 86 02"));
  EXPECT_THAT(Ask(1, kWrite), ElementsAre("12 34 00 00 00 03 01 86 04")) << "still not selected";
}

TEST_F(WriteRules, WithoutSelectThereIsNoSelectRegister) {
  EXPECT_THAT(Ask(1, kSelect), ElementsAre("12 34 00 00 00 03 01 86 02"));
}

}  // namespace
}  // namespace baudgate::modbus
