// What is said of a write, from what was heard and what the point shows then.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/write_end.h"

#include <gtest/gtest.h>

namespace baudgate {
namespace {

using config::Type;

TEST(WriteEndOf, WhatWasSentIsUnknownAndWhatWasNotIsNot) {
  for (const Outcome outcome : {Outcome::no_reply, Outcome::partial, Outcome::corrupt,
                                Outcome::unexpected, Outcome::line_down}) {
    EXPECT_EQ(EndOf(outcome, true), WriteEnd::unknown) << Name(outcome);
    EXPECT_EQ(EndOf(outcome, false), WriteEnd::not_sent) << Name(outcome);
  }
  for (const bool sent : {true, false}) {
    EXPECT_EQ(EndOf(Outcome::ok, sent), WriteEnd::ok);
    EXPECT_EQ(EndOf(Outcome::refused, sent), WriteEnd::refused);
    EXPECT_EQ(EndOf(Outcome::unsupported, sent), WriteEnd::refused);
    EXPECT_EQ(EndOf(Outcome::busy, sent), WriteEnd::busy);
  }
}

struct Case {
  const char* what;
  Type type;
  Value before;
  Value written;
  Value shown;
  bool another;
};

constexpr std::int64_t I(int value) { return value; }

TEST(ShowsAnother, Table) {
  const Case cases[] = {
      {"the same", Type::float32, 0.0, 30.3, 30.3, false},
      {"as a float32", Type::float32, 0.0, 30.3, static_cast<double>(30.3F), false},
      {"beyond a thousandth", Type::float32, 40.0, 30.34, 30.3, true},
      {"within a thousandth", Type::float32, 0.0, 30.32, 30.3, false},
      {"the old one", Type::float32, 10.0, 30.0, 10.0, true},
      {"an output on its way up", Type::float32, 4.0, 20.0, 11.0, false},
      {"and down", Type::float32, 20.0, 4.0, 11.0, false},
      {"beyond", Type::float32, 4.0, 20.0, 21.0, true},
      {"the way is not known", Type::float32, Value(), 20.0, 11.0, true},
      {"zero", Type::float32, 5.0, 0.0, 0.0, false},
      {"not zero", Type::float32, 0.0, 0.0, 0.1, true},
      {"a whole number", Type::uint16, I(1), I(2), I(2), false},
      {"never nearly", Type::uint16, I(1), I(2000), I(1999), true},
      {"nor on its way", Type::uint16, I(1), I(3), I(2), true},
      {"a bit", Type::boolean, false, true, true, false},
      {"a bit that stays", Type::boolean, false, true, false, true},
      {"a text", Type::string, std::string("a"), std::string("b"), std::string("b"), false},
      {"another text", Type::string, std::string("a"), std::string("b"), std::string("a"), true},
      {"nothing is shown", Type::float32, 1.0, 2.0, Value(), false},
  };
  for (const Case& one : cases) {
    config::Point point;
    point.type = one.type;
    point.text_length = 8;
    EXPECT_EQ(ShowsAnother(point, {0, one.written, one.before}, one.shown), one.another)
        << one.what;
  }
}

TEST(ShowsAnother, ADeviceRoundsToItsStepAndDecimals) {
  config::Point point;
  point.type = Type::float32;
  const PointWrite write{0, 0.123, 5.0};
  EXPECT_TRUE(ShowsAnother(point, write, 0.12));
  point.writing.decimals = 2;
  EXPECT_FALSE(ShowsAnother(point, write, 0.12));
  EXPECT_TRUE(ShowsAnother(point, write, 0.11));
  point.writing.decimals.reset();
  point.writing.step = 0.05;
  EXPECT_FALSE(ShowsAnother(point, write, 0.1));
}

/// Two decimals of xIn are steps of 4 A where xIn is 400 A.
TEST(ShowsAnother, DecimalsAreTheDevices) {
  config::Point point;
  point.type = Type::float32;
  point.scale = 400;
  point.writing.decimals = 2;
  const PointWrite write{0, 0.853, 0.5};
  EXPECT_FALSE(ShowsAnother(point, write, 340.0)) << "0.85";
  EXPECT_TRUE(ShowsAnother(point, write, 344.0)) << "0.86";
}

/// Scale 0.1: 25 is written as 250, and 25 is shown.
TEST(ShowsAnother, InUnitsOfTheValue) {
  config::Point point;
  point.type = Type::int16;
  point.scale = 0.1;
  const PointWrite write{0, I(250), I(3)};
  EXPECT_EQ(WrittenValue(point, write), Value(I(25)));
  EXPECT_FALSE(ShowsAnother(point, write, I(25)));
  EXPECT_TRUE(ShowsAnother(point, write, I(3)));
}

}  // namespace
}  // namespace baudgate
