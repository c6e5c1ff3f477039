// How faults of twins are written.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "gateway/tools/simulate/twin_faults.h"
#include "tests/gateway/tools/simulate/twin_faults_fixture.h"

namespace baudgate {
namespace {

using ::testing::HasSubstr;

std::string ErrorOf(const std::string& text) {
  const auto fault = ParseFault(text);
  return fault ? "no error" : fault.error();
}

TEST(FaultText, KindsHaveDefaults) {
  const Fault loss = Parsed("loss");
  EXPECT_EQ(loss.kind, Fault::Kind::loss);
  EXPECT_EQ(loss.rate, 1);
  EXPECT_EQ(loss.seed, 1U);
  EXPECT_EQ(loss.text, "loss");
  EXPECT_EQ(Parsed("bits").count, 1U);
  EXPECT_EQ(Parsed("garbage_before").count, 8U);
  EXPECT_EQ(Parsed("stall").pause, 200ms);
  EXPECT_EQ(Parsed("dribble").pause, 20ms);
  EXPECT_EQ(Parsed("late").pause, 1s);
  EXPECT_EQ(Parsed("late").exchanges, 0U);
  EXPECT_EQ(Parsed("late:exchanges=3").pause, 0s);
  for (const char* name : {"echo", "garbage_after", "wrong_address", "double", "death"}) {
    EXPECT_EQ(Name(Parsed(name).kind), name);
  }
}

TEST(FaultText, KeysAreRead) {
  const Fault bits = Parsed("bits:rate=0.25,seed=7,count=3,after=30s,for=20s,every=1min");
  EXPECT_EQ(bits.kind, Fault::Kind::bits);
  EXPECT_EQ(bits.rate, 0.25);
  EXPECT_EQ(bits.seed, 7U);
  EXPECT_EQ(bits.count, 3U);
  EXPECT_EQ(bits.after, 30s);
  EXPECT_EQ(bits.lasts, 20s);
  EXPECT_EQ(bits.every, 1min);
  EXPECT_EQ(Parsed("garbage_after:bytes=20").count, 20U);
  EXPECT_EQ(Parsed("late:delay=300ms").pause, 300ms);
  EXPECT_EQ(Parsed("late:exchanges=2").exchanges, 2U);
  EXPECT_EQ(Parsed("double:pause=0ms").pause, 0s);
}

TEST(FaultText, RareFaultsHaveAnExponent) {
  EXPECT_DOUBLE_EQ(Parsed("loss:rate=1e-9").rate, 1e-9);
  EXPECT_DOUBLE_EQ(Parsed("loss:rate=2.5E-3,seed=7").rate, 0.0025);
  EXPECT_EQ(Parsed("loss:rate=1e0").rate, 1);
  for (const char* rate : {"1e", "e-9", "1e-9x", "1e-1.5", "1e1", "-1e-9", "0e999", "1e9999999999"})
    EXPECT_THAT(ErrorOf(std::string("loss:rate=") + rate), HasSubstr("write a number from 0"));
}

TEST(FaultText, ErrorsSayWhatMayStandThere) {
  EXPECT_THAT(ErrorOf("los"), HasSubstr("no fault 'los'; did you mean 'loss'?"));
  EXPECT_THAT(ErrorOf(""), HasSubstr("loss, bits, echo, stall, dribble"));
  EXPECT_THAT(ErrorOf("bits:cuont=2"), HasSubstr("fault bits: there is no key 'cuont'; did you "
                                                 "mean 'count'? there are: count, rate, seed"));
  EXPECT_THAT(ErrorOf("loss:count=2"), HasSubstr("fault loss: there is no key 'count'"));
  EXPECT_THAT(ErrorOf("death:rate=0.5"), HasSubstr("there are: after, for, every"));
  EXPECT_THAT(ErrorOf("loss:"), HasSubstr("fault loss: there is no key ''"));
  EXPECT_THAT(ErrorOf("loss:rate"), HasSubstr("key rate has no value"));
  EXPECT_THAT(ErrorOf("loss:seed=1,seed=2"), HasSubstr("seed= stands there twice"));
  EXPECT_THAT(ErrorOf("loss:rate=2"), HasSubstr("fault loss: rate=2: write a number from 0"));
  EXPECT_THAT(ErrorOf("loss:rate=often"), HasSubstr("rate=often: write a number from 0"));
  EXPECT_THAT(ErrorOf("loss:seed=-1"), HasSubstr("seed=-1: write a whole number from 0"));
  EXPECT_THAT(ErrorOf("bits:count=0"), HasSubstr("write a whole number from 1 to 1024"));
  EXPECT_THAT(ErrorOf("late:exchanges=17"), HasSubstr("write a whole number from 1 to 16"));
  EXPECT_THAT(ErrorOf("loss:after=30"), HasSubstr("'30' has no unit"));
  EXPECT_THAT(ErrorOf("loss:for=0s"), HasSubstr("for=0s: write a duration from 1ms"));
  EXPECT_THAT(ErrorOf("stall:pause=1h"), HasSubstr("write a duration from 1ms to 10min"));
  EXPECT_THAT(ErrorOf("loss:every=1min"), HasSubstr("fault loss: every= needs for="));
  EXPECT_THAT(ErrorOf("loss:every=1s,for=1s"), HasSubstr("every= has to be longer than for="));
  EXPECT_THAT(ErrorOf("late:delay=1s,exchanges=1"), HasSubstr("not both"));
}

}  // namespace
}  // namespace baudgate
