// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/lines/server_connection.h"

namespace baudgate {
namespace {

const Instant kOpened{100s};

TEST(ConnectionProof, ALocalPortWorksWhenItIsOpen) {
  ConnectionProof proof(false);
  EXPECT_TRUE(proof.OnOpened(kOpened));
  EXPECT_FALSE(proof.check_at());
  EXPECT_TRUE(proof.OnLost());
  EXPECT_TRUE(proof.OnOpened(kOpened));
}

TEST(ConnectionProof, BytesProveItOnlyBehindTheTimeOfAGreeting) {
  const struct {
    Duration first;
    Duration lost;
    bool worked;
  } rows[] = {{100ms, 300ms, false}, {100ms, 600ms, true}, {600ms, 700ms, true}};
  for (const auto& row : rows) {
    ConnectionProof proof(true);
    proof.OnOpened(kOpened);
    bool proven = proof.NoteBytes(kOpened + row.first);
    EXPECT_EQ(proven, row.first >= 500ms);
    if (row.lost >= 500ms && !proven) proven = proof.OnCheck(*proof.check_at(), false);
    EXPECT_EQ(proven, row.worked);
    EXPECT_EQ(proof.OnLost(), row.worked);
  }
}

TEST(ConnectionProof, WhereNobodyAnswersItIsProvenByHoldingFor30s) {
  ConnectionProof proof(true);
  proof.OnOpened(kOpened);
  Duration held{};
  while (!proof.OnCheck(*proof.check_at(), false)) {
    held = *proof.check_at() - kOpened;
    ASSERT_LE(held, 40s);
  }
  EXPECT_GE(held, 30s);
}

TEST(ConnectionProof, BehindAUselessOneTheNextIsNewsOnceItIsProven) {
  ConnectionProof proof(true);
  EXPECT_TRUE(proof.OnOpened(kOpened));
  EXPECT_FALSE(proof.OnLost());
  EXPECT_FALSE(proof.OnOpened(kOpened + 1s));
  EXPECT_TRUE(proof.Prove());
  EXPECT_TRUE(proof.TakeNews());
  EXPECT_FALSE(proof.TakeNews()) << "once";
  EXPECT_FALSE(proof.Prove());
  EXPECT_TRUE(proof.OnLost());
}

TEST(ConnectionProof, AfterALoanTheSameConnectionGoesOn) {
  ConnectionProof proof(true);
  proof.OnOpened(kOpened);
  proof.NoteBytes(kOpened + 1s);
  proof.Pause();
  EXPECT_FALSE(proof.check_at());
  proof.GoOn(kOpened + 60s);
  EXPECT_EQ(proof.check_at(), kOpened + 60500ms);
  EXPECT_TRUE(proof.OnLost());
}

}  // namespace
}  // namespace baudgate
