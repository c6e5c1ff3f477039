// Tests of texts that other people have chosen, such as the subject of a certificate.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/text.h"

#include <gtest/gtest.h>

namespace baudgate {
namespace {

TEST(WithoutControls, ReplacesWhatWouldForgeOrTurnALine) {
  EXPECT_EQ(WithoutControls("größe 5 µV — ok"), "größe 5 µV — ok");
  EXPECT_EQ(WithoutControls("a\nb\x1B\x7F"), "a\\x0Ab\\x1B\\x7F");
  EXPECT_EQ(WithoutControls("a\u0085b\u009F"), "a\\xC2\\x85b\\xC2\\x9F");
  EXPECT_EQ(WithoutControls("\u200B\u200F"), "\\xE2\\x80\\x8B\\xE2\\x80\\x8F");
  EXPECT_EQ(WithoutControls("\u2028\u2029"), "\\xE2\\x80\\xA8\\xE2\\x80\\xA9");
  EXPECT_EQ(WithoutControls("\u202A\u202E"), "\\xE2\\x80\\xAA\\xE2\\x80\\xAE");
  EXPECT_EQ(WithoutControls("\u2066\u2069"), "\\xE2\\x81\\xA6\\xE2\\x81\\xA9");
  EXPECT_EQ(WithoutControls("\u00A0\u200A\u2010\u2027\u202F\u2065\u206A"),
            "\u00A0\u200A\u2010\u2027\u202F\u2065\u206A")
      << "the neighbours stay";
  EXPECT_EQ(WithoutControls("cut \xE2\x80"), "cut \xE2\x80");
}

}  // namespace
}  // namespace baudgate
