// Soak of the runs in tests/protocols/runs/lag_test.cpp with real clocks, timers and threads: lines
// on ptys behind lagging servers, and an oracle that judges every good reading. It takes some
// seconds in ctest, an hour by `packaging/soak.sh ptys 60`. BAUDGATE_SOAK_SECONDS sets the length;
// BAUDGATE_LAG_SEED repeats a run.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <asio/io_context.hpp>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iterator>
#include <memory>
#include <random>
#include <string_view>
#include <vector>

#include "gateway/base/log.h"
#include "tests/soak/lag_soak_line.h"
#include "tests/support/long_run.h"

namespace baudgate {
namespace {

constexpr Duration kLookAtLag = 10ms;
constexpr Duration kLagPatience = 2min;
constexpr Duration kLongestTurn = 1min;
constexpr Duration kShortestTurn = 4s;

class LagSoak : public ::testing::Test {
 protected:
  LagSoak() {
    log::Begin(log::Level::error);
    std::string pattern = (std::filesystem::temp_directory_path() / "baudgate-lag-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    auto seed =
        static_cast<unsigned>(Setting("BAUDGATE_LAG_SEED", std::random_device()() % 1'000'000));
    fmt::print("seed {}\n", seed);
    std::fflush(stdout);
    for (const protocols::LagCase& which : protocols::LagCases()) {
      constexpr std::string_view kLines[] = {"Spa9600", "Dcon9600", "Set4tm9600", "ModbusRtu19200"};
      if (std::ranges::find(kLines, which.setup.name) == std::end(kLines)) continue;
      const std::string path = (folder_ / which.name()).string();
      lines_.push_back(std::make_unique<LagSoakLine>(which, seed++, path, world_));
    }
  }
  ~LagSoak() override {
    lines_.clear();
    std::filesystem::remove_all(folder_);
  }

  /// Runs everything except the lines' threads until `done` is true. Returns false after `limit`.
  bool RunUntil(const std::function<bool()>& done, Duration limit) {
    const Instant until = std::chrono::steady_clock::now() + limit;
    while (!done()) {
      if (std::chrono::steady_clock::now() > until) return false;
      world_.run_for(kLookAtLag);
      for (const auto& line : lines_) line->Look();
    }
    return true;
  }

  void ExpectAllGood(const std::string& when) {
    RunUntil([this] { return std::ranges::all_of(lines_, IsWell); }, kLagPatience);
    for (const auto& line : lines_) {
      EXPECT_TRUE(IsWell(line)) << line->which().name() << ": not every point is good " << when;
    }
  }

  static bool IsWell(const std::unique_ptr<LagSoakLine>& line) {
    return !line->IsReplacing() && line->AllGood();
  }

  asio::io_context world_{1};
  std::filesystem::path folder_;
  std::vector<std::unique_ptr<LagSoakLine>> lines_;
};

TEST_F(LagSoak, NoWrongValueIsEverGood) {
  ExpectAllGood("at the beginning");
  ASSERT_FALSE(HasFailure());

  const Duration length = std::chrono::seconds(Setting("BAUDGATE_SOAK_SECONDS", 4));
  const Duration turn = std::clamp(length / 4, kShortestTurn, kLongestTurn);
  for (const auto& line : lines_) line->BeginTroubles(turn);
  RunUntil([] { return false; }, length);
  for (const auto& line : lines_) line->EndTroubles();
  ExpectAllGood("after the troubles");

  for (const auto& line : lines_) {
    EXPECT_GT(line->oracle().judged(), 0U) << line->which().name();
    line->PrintSummary();
  }
  fmt::print("{}: {}\n", FormatDuration(length), HasFailure() ? "FAILED" : "good");
}

}  // namespace
}  // namespace baudgate
