// Tests of SteadyVector: its elements never move.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/steady_vector.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace baudgate {
namespace {

TEST(SteadyVector, ElementsNeverMove) {
  SteadyVector<int> numbers;
  std::vector<int*> places;
  for (int i = 0; i < 1000; ++i) places.push_back(&numbers.Append(i));
  ASSERT_EQ(numbers.size(), 1000U);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(numbers[static_cast<std::size_t>(i)], i);
    EXPECT_EQ(&numbers[static_cast<std::size_t>(i)], places[static_cast<std::size_t>(i)]);
  }
}

TEST(SteadyVector, CanBeReadWhileItGrows) {
  SteadyVector<std::size_t> numbers;
  std::atomic<bool> wrong = false;
  std::thread reader([&] {
    for (std::size_t seen = 0; seen < 5000;) {
      seen = numbers.size();
      for (std::size_t i = seen / 2; i < seen; ++i) wrong = wrong || numbers[i] != i;
    }
  });
  for (std::size_t i = 0; i < 5000; ++i) numbers.Append(i);
  reader.join();
  EXPECT_FALSE(wrong);
}

}  // namespace
}  // namespace baudgate
