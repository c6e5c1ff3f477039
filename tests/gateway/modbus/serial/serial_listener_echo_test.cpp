// A two-wire adapter that gives the gateway its own replies back: an echo is never carried out.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/gateway/modbus/serial/serial_listener_fixture.h"

namespace baudgate::modbus {
namespace {

TEST_F(SerialListenerTest, AnEchoIsNoRequest) {
  Begin();
  Say(1, "03 00 00 00 01");
  Expect(1, "03 02 FF FE");
  Say(1, "03 02 FF FE");
  Say(1, "06 00 00 00 07");
  ASSERT_TRUE(Commanded(1));
  sink_.commands[0].done(Outcome::ok, "");
  Expect(1, "06 00 00 00 07");
  Say(1, "06 00 00 00 07");
  ExpectSilence();
  EXPECT_EQ(sink_.commands.size(), 1U);
  Say(1, "06 00 00 00 07");
  ASSERT_TRUE(Commanded(2)) << "the master repeats it";
}

TEST_F(SerialListenerTest, WithoutAnEchoAWriteMayBeRepeatedAtOnce) {
  Begin();
  AskForTheValue();
  ExpectSilence();
  for (std::size_t i = 1; i <= 3; ++i) WriteOnce(i);
}

TEST_F(SerialListenerTest, ALateEchoOfTheFirstWriteIsNotCarriedOut) {
  Begin();
  WriteOnce(1);
  ExpectSilence();
  Say(1, "06 00 00 00 07");
  Expect(1, "86 06");
  Say(1, "86 06");
  ExpectSilence();
  EXPECT_EQ(sink_.commands.size(), 1U);
  WriteOnce(2);
  ExpectSilence();
  Say(1, "06 00 00 00 07");
  ExpectSilence();
  EXPECT_EQ(sink_.commands.size(), 2U) << "the adapter is known to echo";
  WriteOnce(3);
}

TEST_F(SerialListenerTest, AMasterThatOnlyEverWritesTheSameIsPutOffOnce) {
  Begin();
  WriteOnce(1);
  ExpectSilence();
  Say(1, "06 00 00 00 07");
  Expect(1, "86 06");
  ExpectSilence();
  for (std::size_t i = 2; i <= 4; ++i) WriteOnce(i);
}

TEST_F(SerialListenerTest, AnEchoThatComesWhileAnotherRequestIsUnderWayIsPassedOver) {
  Begin();
  WriteOnce(1);
  ExpectSilence();
  Bytes bytes = Rtu(20, "03 00 C8 00 01");
  Append(bytes, View(Rtu(1, "06 00 00 00 07")));
  master_->Write(bytes);
  ASSERT_TRUE(Asked(1));
  ExpectSilence();
  target_.Answer(0, "03 02 09 C4");
  Expect(20, "03 02 09 C4");
  EXPECT_EQ(sink_.commands.size(), 1U);
}

TEST_F(SerialListenerTest, AnEchoIsNoFrameOfTheBus) {
  Begin();
  AskForTheValue();
  Say(1, "03 02 FF FE");
  WriteOnce(1);
  Say(1, "06 00 00 00 07");
  ExpectSilence();
  EXPECT_EQ(Master().frames, 2U);
}

}  // namespace
}  // namespace baudgate::modbus
