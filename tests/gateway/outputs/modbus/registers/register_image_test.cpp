// The image of a unit answers as the direct way does, whatever happens to values, age and device.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/registers/register_image.h"

#include <gtest/gtest.h>

#include <limits>

#include "gateway/outputs/modbus/registers/register_contents.h"
#include "tests/gateway/outputs/modbus/registers/points.h"
#include "tests/support/times.h"

namespace baudgate::modbus {
namespace {

using config::OnBad;
using config::Table;
using config::Type;

constexpr std::size_t kAll = 1000;  // asks for so much that a stale image is made anew

/// An answer either way: exception and words.
struct Answer {
  ExceptionCode exception = kNoException;
  std::vector<int> words;
  bool operator==(const Answer&) const = default;
};

/// Registers: float 0-1, int16 2, text 3-4 (slow), a gap, uint16 6, write-only 7, uint16 8;
/// bits 0, 1 and 3.
class RegisterImageTest : public testing::TestWithParam<OnBad> {
 protected:
  RegisterImageTest() : config_(MakeConfig({MakeDevice(1, Points())})) {
    config_.lines[0].devices[0].on_bad = GetParam();
    map_.emplace(config_);
    store_.emplace(config_);
    image_.emplace(map_->unit(1));
  }

  static std::vector<config::Point> Points() {
    std::vector<config::Point> points = {
        MakePoint(Type::float32, 0),
        MakePoint(Type::int16, 2),
        MakeText(4, 3),
        MakePoint(Type::uint16, 6),
        MakePoint(Type::uint16, 7, config::Access::write),
        MakePoint(Type::uint16, 8),
        MakePoint(Type::boolean, 0),
        MakePoint(Type::boolean, 1),
        MakePoint(Type::boolean, 3),
    };
    points[2].group = config::Group::slow;
    return points;
  }

  void Update(std::uint32_t index, Value value, Quality quality = Quality::good,
              Instant at = kStart) {
    const Sample sample{index, std::move(value), quality};
    store_->Update(0, std::span(&sample, 1), {at, {}}, 3ms);
  }
  void UpdateAll(Instant at = kStart) {
    const std::vector<Value> values = {123456.0,
                                       std::int64_t{-5},
                                       std::string("OK"),
                                       std::int64_t{6},
                                       std::int64_t{7},
                                       std::int64_t{8},
                                       true,
                                       false,
                                       true};
    for (std::uint32_t i = 0; i < values.size(); ++i) Update(i, values[i], Quality::good, at);
  }

  bool Refresh(Instant now, std::size_t asked = kAll) {
    bool fresh = false;
    store_->Read(0,
                 [&](const DeviceRecord& record) { fresh = image_->Refresh(record, now, asked); });
    return fresh;
  }

  template <typename Word>
  Answer Direct(Table table, std::uint16_t start, std::uint16_t count, Instant now) {
    std::vector<Word> out(count);
    std::vector<Piece> pieces;
    Answer answer;
    answer.exception = PlanRead(map_->unit(1), table, start, count, pieces);
    if (answer.exception != kNoException) return answer;
    store_->Read(0, [&](const DeviceRecord& record) {
      if constexpr (std::is_same_v<Word, std::uint8_t>) {
        answer.exception = FillBits(record, pieces, now, out);
      } else {
        answer.exception = FillRegisters(record, pieces, now, out);
      }
    });
    if (answer.exception == kNoException) answer.words.assign(out.begin(), out.end());
    return answer;
  }

  /// Every range of up to twelve: what the image has is what the direct way says, and what it has
  /// not is an exception or goes beyond one run of one area.
  template <typename Word>
  std::size_t CompareTable(Table table, Instant now) {
    std::size_t found = 0;
    for (const std::uint16_t base : {std::uint16_t{0}, kQualityOffset}) {
      for (std::uint16_t start = base; start < base + 12; ++start) {
        for (std::uint16_t count = 1; count <= 12; ++count) {
          const auto place = image_->Find(table, start, count);
          // A bit alone is never in the image: it may be an exception that it is not in a block.
          if (table == Table::bits && count == 1 && base == 0) {
            EXPECT_FALSE(place);
            continue;
          }
          const Answer direct = Direct<Word>(table, start, count, now);
          EXPECT_EQ(place.has_value(),
                    direct.exception == kNoException || direct.exception == kNoTarget)
              << start << '+' << count;
          if (!place) continue;
          ++found;
          std::vector<Word> out(count);
          Answer image{image_->Copy(*place, std::span(out)), {}};
          if (image.exception == kNoException) image.words.assign(out.begin(), out.end());
          EXPECT_EQ(image, direct) << start << '+' << count;
        }
      }
    }
    return found;
  }

  void Compare(Instant now) {
    ASSERT_TRUE(Refresh(now));
    EXPECT_GT(CompareTable<std::uint16_t>(Table::registers, now), 20U);
    EXPECT_GT(CompareTable<std::uint8_t>(Table::bits, now), 4U);
  }

  config::Config config_;
  std::optional<RegisterMap> map_;
  std::optional<PointStore> store_;
  std::optional<RegisterImage> image_;
};

TEST_P(RegisterImageTest, AnswersAsTheDirectWayForEveryQuality) {
  Compare(kStart);  // never read
  UpdateAll();
  Compare(kStart);
  for (const Quality quality :
       {Quality::uncertain, Quality::uncertain_last_usable, Quality::uncertain_sub_normal,
        Quality::bad, Quality::bad_configuration, Quality::bad_not_connected,
        Quality::bad_device_failure, Quality::bad_sensor_failure, Quality::bad_last_known,
        Quality::bad_communication, Quality::bad_out_of_service, Quality::bad_waiting}) {
    for (const std::uint32_t point : {0U, 1U, 2U, 5U, 6U}) {
      Update(point, Value(), quality);
      Compare(kStart);
      Update(point, std::int64_t{1});
    }
  }
}

TEST_P(RegisterImageTest, AnswersAsTheDirectWayForValuesThatDoNotFit) {
  UpdateAll();
  Update(1, std::int64_t{40000});
  Update(6, std::numeric_limits<double>::quiet_NaN());
  Compare(kStart);
}

TEST_P(RegisterImageTest, AgeingMakesItStaleAtTheInstantThatItChangesAQuality) {
  UpdateAll();
  Update(1, std::int64_t{1}, Quality::good, kStart + 500ms);
  ASSERT_TRUE(Refresh(kStart));
  EXPECT_TRUE(Refresh(kStart + 3s, 0));
  for (const Duration age : {3s + 1ns, 3s + 500ms + 1ns, 9s + 1ns, 9s + 500ms + 1ns}) {
    EXPECT_FALSE(Refresh(kStart + age, 0)) << FormatDuration(age);
    Compare(kStart + age);
    EXPECT_TRUE(Refresh(kStart + age, 0));
  }
  EXPECT_FALSE(Refresh(kStart, 0)) << "it says nothing about the time before it was made";
}

TEST_P(RegisterImageTest, EveryChangeMakesItStale) {
  UpdateAll();
  Compare(kStart);
  Update(3, std::int64_t{66});
  EXPECT_FALSE(Refresh(kStart, 0));
  Compare(kStart);
  for (const Override why :
       {Override(Quality::bad_out_of_service), Override(Quality::bad_not_connected),
        Override(Quality::bad_communication), Override(QualityOfDevice(Reason::swapped)),
        Override()}) {
    store_->SetOverride(0, why);
    EXPECT_FALSE(Refresh(kStart, 0));
    Compare(kStart);
    Compare(kStart + 4s);
    ASSERT_TRUE(Refresh(kStart));
  }
  store_->SetLineCycle(0, 60s, kStart);  // the limit of age grows
  EXPECT_FALSE(Refresh(kStart, 0));
  Compare(kStart + 100s);
  store_->SetLineCycle(0, 1ms, kStart);
  Compare(kStart + 100s);
}

TEST_P(RegisterImageTest, WhatChangesNoValueLeavesItFresh) {
  UpdateAll();
  Compare(kStart);
  store_->UpdateStatus(0, [](DeviceStatus& status) { ++status.exchanges; });
  store_->SetLineCycle(0, 1ms, kStart);  // still below the limits of age
  EXPECT_TRUE(Refresh(kStart, 0));
}

TEST_P(RegisterImageTest, AStaleOneIsMadeAnewWhenAsMuchHasBeenAskedForAsItHas) {
  UpdateAll();
  constexpr std::size_t kWords = 7 + 3;
  EXPECT_FALSE(Refresh(kStart, kWords - 1));
  EXPECT_TRUE(Refresh(kStart, 1));
  Update(0, 1.0);
  EXPECT_FALSE(Refresh(kStart, kWords - 1)) << "the count begins again";
}

INSTANTIATE_TEST_SUITE_P(OnBad, RegisterImageTest,
                         testing::Values(OnBad::exception, OnBad::hold, OnBad::nan));

}  // namespace
}  // namespace baudgate::modbus
