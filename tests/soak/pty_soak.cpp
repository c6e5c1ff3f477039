// Soak in real time on ptys: one line for each protocol, simulated devices with every fault, and a
// reader that compares with the true values. It takes ten minutes under AddressSanitizer by
// `packaging/soak.sh ptys`, some seconds in ctest. BAUDGATE_SOAK_SECONDS sets the length.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <stdlib.h>

#include <algorithm>
#include <asio/executor_work_guard.hpp>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <thread>
#include <vector>

#include "gateway/base/log.h"
#include "tests/soak/soak_line.h"
#include "tests/support/long_run.h"

#ifdef __SANITIZE_ADDRESS__
extern "C" std::size_t __sanitizer_get_current_allocated_bytes();  // GCC 12 ships no header for it
#endif

namespace baudgate {
namespace {

constexpr Duration kLook = 10ms;
constexpr Duration kProgress = 10s;
constexpr Duration kSampleHeap = 1s;
constexpr Duration kPatience = 5min;
// After the first third of the soak, the heap may exceed its maximum of that third by this many
// bytes.
constexpr std::size_t kFlat = 256 * 1024;

Duration Length() { return std::chrono::seconds(Setting("BAUDGATE_SOAK_SECONDS", 4)); }

std::size_t HeapInUse() {
#ifdef __SANITIZE_ADDRESS__
  return __sanitizer_get_current_allocated_bytes();
#else
  return mallinfo2().uordblks;
#endif
}

class PtySoak : public ::testing::Test {
 protected:
  PtySoak() : thread_([this] { world_.run(); }) {
    log::Begin(log::Level::error);
    std::string pattern =
        (std::filesystem::temp_directory_path() / "baudgate-soak-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    AddLine("Spa9600", false);
    AddLine("Dcon9600", false);
    AddLine("Set4tm9600", true);
  }
  ~PtySoak() override {
    lines_.clear();
    world_.stop();
    thread_.join();
    std::filesystem::remove_all(folder_);
  }

  void AddLine(const std::string& name, bool echoes) {
    lines_.push_back(std::make_unique<SoakLine>(protocols::RealLine(name), echoes,
                                                (folder_ / name).string(), world_));
  }

  void Look() {
    std::this_thread::sleep_for(kLook);
    for (const auto& line : lines_) line->Check();
  }

  void ExpectAllGood(const std::string& when) {
    const Instant limit = std::chrono::steady_clock::now() + kPatience;
    for (const auto& line : lines_) {
      while (!line->AllGood() && std::chrono::steady_clock::now() < limit) Look();
      EXPECT_TRUE(line->AllGood()) << line->name() << ": not every point is good " << when;
    }
  }

  void Suffer(Duration time) {
    const Instant begin = std::chrono::steady_clock::now();
    Instant progress = begin + kProgress;
    Instant sample = begin;
    for (Instant now = begin; now < begin + time; now = std::chrono::steady_clock::now()) {
      Look();
      if (now >= progress) {
        progress += kProgress;
        for (const auto& line : lines_) line->ExpectProgress();
      }
      if (now < sample) continue;
      sample += kSampleHeap;
      std::size_t& most = now < begin + time / 3 ? most_early_ : most_later_;
      most = std::max(most, HeapInUse());
    }
  }

  asio::io_context world_{1};
  asio::executor_work_guard<asio::io_context::executor_type> work_{world_.get_executor()};
  std::thread thread_;
  std::filesystem::path folder_;
  std::vector<std::unique_ptr<SoakLine>> lines_;
  std::size_t most_early_ = 0;
  std::size_t most_later_ = 0;
};

TEST_F(PtySoak, NoWrongValueIsEverGoodAndMemoryDoesNotGrow) {
  ExpectAllGood("on a clean line");
  for (const auto& line : lines_) line->CompareWithTruth();
  ASSERT_FALSE(HasFailure());

  for (const auto& line : lines_) line->BeginFaults(Length());
  Suffer(Length());
  for (const auto& line : lines_) line->EndFaults();
  ExpectAllGood("after the faults");
  EXPECT_LT(most_later_, most_early_ + kFlat);

  for (const auto& line : lines_) {
    EXPECT_GT(line->struck(), 0U) << line->name();
    line->PrintSummary();
  }
  fmt::print("{}: heap at most {} KiB in the first third, {} KiB later: {}\n",
             FormatDuration(Length()), most_early_ / 1024, most_later_ / 1024,
             HasFailure() ? "FAILED" : "good");
}

}  // namespace
}  // namespace baudgate
