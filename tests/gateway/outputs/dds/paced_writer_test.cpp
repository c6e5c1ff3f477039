// How often a writer without room is asked again.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/outputs/dds/sample_writer.h"
#include "tests/gateway/outputs/dds/remembering_writer.h"

namespace baudgate::dds {
namespace {

TEST(PacedWriter, RestsLongerEachTimeThereIsNoRoom) {
  testing::RememberingWriter writer;
  PacedWriter paced(writer, {});
  Instant now = Instant() + 1h;
  writer.answer = Sent::later;
  for (const Duration rest : {1ms, 2ms, 4ms, 8ms, 10ms, 10ms}) {
    ASSERT_TRUE(paced.MayWrite(now));
    EXPECT_EQ(paced.Write(PointSample(), now), Sent::later);
    EXPECT_EQ(paced.ReadyAt(), now + rest);
    EXPECT_FALSE(paced.MayWrite(now + rest - 1us));
    now += rest;
  }
  writer.answer = Sent::yes;
  EXPECT_EQ(paced.Write(PointSample(), now), Sent::yes);
  writer.answer = Sent::later;
  EXPECT_EQ(paced.Write(PointSample(), now), Sent::later);
  EXPECT_EQ(paced.ReadyAt(), now + 1ms);
  paced.ForgetHold();
  EXPECT_TRUE(paced.MayWrite(now)) << "there is a new receiver";
  EXPECT_EQ(paced.written(), 1U);
  EXPECT_EQ(paced.failed(), 0U) << "nothing was refused";
}

}  // namespace
}  // namespace baudgate::dds
