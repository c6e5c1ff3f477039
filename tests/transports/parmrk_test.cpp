// The marks of the tty layer, in any fragmentation.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/transports/far_end.h"
#include "transports/parity.h"

namespace baudgate {
namespace {

Bytes AsTheKernelWrites(View characters) {
  Bytes marked;
  for (const std::uint8_t character : characters) {
    marked.push_back(character);
    if (character == 0xFF) marked.push_back(0xFF);
  }
  return marked;
}

TEST(ParmrkDecoder, EveryCleanByteComesBack) {
  ParmrkDecoder decoder;
  EXPECT_EQ(decoder.Decode(AsTheKernelWrites(test::AllBytes())), test::AllBytes());
  EXPECT_EQ(decoder.damaged(), 0U);
}

TEST(ParmrkDecoder, DamagedCharacterKeepsItsPlace) {
  ParmrkDecoder decoder;
  const Bytes marked = {'>', '+', '1', 0xFF, 0x00, '2', '.', '3', '\r'};
  const Bytes expected = {'>', '+', '1', kDamaged, '.', '3', '\r'};
  EXPECT_EQ(decoder.Decode(marked), expected);
  EXPECT_EQ(decoder.damaged(), 1U);
}

TEST(ParmrkDecoder, BreakIsDamage) {
  ParmrkDecoder decoder;
  EXPECT_EQ(decoder.Decode(Bytes{0xFF, 0x00, 0x00, 'A'}), (Bytes{kDamaged, 'A'}));
  EXPECT_EQ(decoder.damaged(), 1U);
}

TEST(ParmrkDecoder, DamagedFfIsNotAnotherEscape) {
  ParmrkDecoder decoder;
  EXPECT_EQ(decoder.Decode(Bytes{0xFF, 0x00, 0xFF, 0x00, 'A'}), (Bytes{kDamaged, 0x00, 'A'}));
  EXPECT_EQ(decoder.damaged(), 1U);
}

TEST(ParmrkDecoder, AnUnknownMarkIsDamage) {
  ParmrkDecoder decoder;
  EXPECT_EQ(decoder.Decode(Bytes{0xFF, 0x41, 'B'}), (Bytes{kDamaged, 'B'}));
  EXPECT_EQ(decoder.damaged(), 1U);
}

TEST(ParmrkDecoder, AnyFragmentationGivesTheSame) {
  const Bytes marked = {'a', 0xFF, 0xFF, 0xFF, 0x00, 0x33, 0x00, 0xFF, 0x00, 0x00, 0xFF, 0xFF};
  const Bytes expected = {'a', 0xFF, kDamaged, 0x00, kDamaged, 0xFF};
  test::EachFragmentation(marked, [&](const std::vector<Bytes>& pieces) {
    ParmrkDecoder decoder;
    Bytes characters;
    for (const Bytes& piece : pieces) Append(characters, decoder.Decode(piece));
    ASSERT_EQ(characters, expected);
    ASSERT_EQ(decoder.damaged(), 2U);
  });
}

}  // namespace
}  // namespace baudgate
