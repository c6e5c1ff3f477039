// What the latest exchanges of a device looked like, and what can be read off them together.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/store/findings.h"

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
  EXPECT_FALSE(findings.IsSevenBit()) << "nothing has come";
  findings.Add({.symptom = bad_check, .bytes = 7});
  EXPECT_TRUE(findings.IsSevenBit());
  findings.Add({.symptom = bad_check, .bytes = 7, .specials = kHighBit});
  EXPECT_FALSE(findings.IsSevenBit());
}

}  // namespace
}  // namespace baudgate
