// What the latest exchanges of a device looked like, and what can be read off them together.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/points/findings.h"

#include <gtest/gtest.h>

namespace baudgate {
namespace {

using enum Symptom;

Findings After(std::initializer_list<Symptom> symptoms) {
  Findings findings;
  for (const Symptom symptom : symptoms) findings.Add({.symptom = symptom});
  return findings;
}

TEST(Findings, OutagesAreToldFromSingleLosses) {
  const Findings losses = After({silence, clean, clean, damaged, clean, silence});
  EXPECT_EQ(losses.Runs(), 3U);
  EXPECT_EQ(losses.LongestRun(), 1U);
  const Findings outage = After({clean, silence, silence, silence, silence, clean});
  EXPECT_EQ(outage.Runs(), 1U);
  EXPECT_EQ(outage.LongestRun(), 4U);
  EXPECT_EQ(After({clean, refusal, copies}).Runs(), 0U);
}

TEST(Findings, WhatComesLaterChangesAnEarlierOne) {
  Findings findings = After({tail_lost, clean, clean});
  findings.Amend({.symptom = split, .time = 400ms}, 2);
  EXPECT_EQ(findings.Count(tail_lost), 0U);
  EXPECT_EQ(findings.Count(split), 1U);
  EXPECT_EQ(findings.Count(clean), 2U);
  findings.Amend({.symptom = late}, 3);
  EXPECT_EQ(findings.Count(late), 0U) << "that one is not kept any more";
}

TEST(Findings, BytesThatAreAlwaysTheSame) {
  Findings findings;
  for (int i = 0; i < 5; ++i) findings.Add({.symptom = few_beside, .cause = "10 02 ..."});
  findings.Add({.symptom = clean});
  EXPECT_EQ(findings.SameAround(), 5U);
  EXPECT_EQ(findings.Around(), "10 02 ...");
  findings.Add({.symptom = noise_before, .cause = "A7 31 09 5C ..."});
  EXPECT_EQ(findings.SameAround(), 1U);
}

TEST(Findings, CharactersWithoutTheirEighthBit) {
  Findings findings;
  EXPECT_FALSE(findings.specials().IsSevenBit()) << "nothing has come";
  findings.Add({.symptom = bad_check, .bytes = 7, .specials = kEvenByte | kOddByte});
  EXPECT_TRUE(findings.specials().IsSevenBit());
  findings.Add({.symptom = bad_check, .bytes = 7, .specials = kHighBit | kOddByte});
  EXPECT_FALSE(findings.specials().IsSevenBit());
}

TEST(Findings, CharactersOfOneParity) {
  constexpr std::uint8_t kMark = 0x10;
  Findings findings;
  findings.Add({.symptom = bad_check, .bytes = 7, .specials = kEvenByte});
  EXPECT_FALSE(findings.specials().IsOneParity()) << "no FF came";
  findings.Add({.symptom = bad_check, .bytes = 7, .specials = kEvenByte | kMark});
  EXPECT_TRUE(findings.specials().IsOneParity());
  EXPECT_EQ(findings.specials().Suspects(), 0U) << "one came without FF";
  findings.Add({.symptom = bad_check, .bytes = 7, .specials = kOddByte | kMark});
  EXPECT_FALSE(findings.specials().IsOneParity());
}

TEST(Findings, SilenceBehindAShortPauseOnly) {
  Findings findings;
  findings.Add({.symptom = silence, .idle = 90ms});
  EXPECT_EQ(findings.ShortPause(), Duration()) << "nothing was ever answered";
  findings.Add({.symptom = clean, .idle = kLongIdle});
  for (int i = 0; i < 40; ++i) findings.Add({.symptom = silence, .idle = 90ms});
  EXPECT_EQ(findings.ShortPause(), Duration(90ms)) << "the good one is long out of sight";
  findings.Add({.symptom = clean, .idle = 20ms});
  EXPECT_EQ(findings.ShortPause(), Duration());
}

/// A serial server with a smaller buffer was put in between.
TEST(Findings, LongRepliesThatComeDamagedSinceLaterAreKnown) {
  Findings findings;
  const Finding whole{.symptom = clean, .bytes = 49, .expected = 49};
  const Finding cut{.symptom = tail_lost, .bytes = 32, .expected = 49};
  const Finding small{.symptom = clean, .bytes = 7, .expected = 7};
  findings.Add(whole);
  for (int i = 0; i < 23; ++i) {
    findings.Add(cut);
    findings.Add(small);
  }
  EXPECT_EQ(findings.lengths().longest_good(), 49U) << "that may be chance";
  findings.Add(cut);
  EXPECT_EQ(findings.lengths().longest_good(), 7U);
  EXPECT_EQ(findings.lengths().damaged().shortest, 49U);
  findings.Add(whole);
  EXPECT_EQ(findings.lengths().damaged().count, 0U);
}

TEST(Findings, AShortRefusalIsNoLongReply) {
  Findings findings;
  findings.Add({.symptom = clean, .bytes = 4, .expected = 8});
  EXPECT_EQ(findings.lengths().longest_good(), 4U);
}

}  // namespace
}  // namespace baudgate
