// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/absences.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

namespace baudgate::control {
namespace {

/// If single losses are this unlikely to stand so close together, they are outages.
constexpr double kChance = 0.001;
/// An outage has at least this many failures on average: the request and its repeat.
constexpr double kFewest = 2;
/// This many coincidences are no chance.
constexpr std::size_t kOften = 2;
/// A period needs this many beginnings, and its longest is at most this many times its shortest.
constexpr std::size_t kBeginnings = 3;
constexpr double kRegular = 1.4;
/// A silence of more than this many times the longest before is a new trouble.
constexpr double kUsual = 2;

/// The logarithm of the number of ways to choose `some` of `all`.
double LogWays(double all, double some) {
  double ways = 0;
  for (double i = 1; i <= some; ++i) ways += std::log((all - some + i) / i);
  return ways;
}

/// The probability that independent failures stand in this many runs or fewer (runs test of Wald
/// and Wolfowitz).
double Chance(const FailureTally& tally) {
  const double all = LogWays(tally.failed + tally.answered, tally.failed);
  double chance = 0;
  for (double runs = 1; runs <= std::min(tally.runs, tally.answered + 1); ++runs) {
    chance +=
        std::exp(LogWays(tally.failed - 1, runs - 1) + LogWays(tally.answered + 1, runs) - all);
  }
  return chance;
}

/// The mean of its shortest possible length (first failure to last) and its longest (answer to
/// answer).
Duration LengthOf(const FailureRuns::Run& run) {
  const Duration least = run.last - run.first;
  const Duration most = *run.after - run.before.value_or(run.first);
  return (least + most) / 2;
}

std::vector<FailureRuns::Run> Ended(const FailureRuns& failures) {
  std::vector<FailureRuns::Run> ended;
  std::ranges::copy_if(failures.runs(), std::back_inserter(ended),
                       [](const FailureRuns::Run& run) { return run.after.has_value(); });
  return ended;
}

std::optional<Duration> PeriodOf(const std::vector<FailureRuns::Run>& runs) {
  if (runs.size() < kBeginnings) return std::nullopt;
  Duration shortest = Duration::max();
  Duration longest{};
  for (std::size_t i = 1; i < runs.size(); ++i) {
    const Duration between = runs[i].first - runs[i - 1].first;
    shortest = std::min(shortest, between);
    longest = std::max(longest, between);
  }
  const auto count = static_cast<std::int64_t>(runs.size() - 1);
  if (longest > kRegular * shortest) return std::nullopt;
  return (runs.back().first - runs.front().first) / count;
}

}  // namespace

FailureTally TallyOf(const FailureRuns& failures) {
  FailureTally tally;
  tally.answered = failures.answered();
  for (const FailureRuns::Run& run : failures.runs()) {
    tally.failed += run.failed;
    tally.answered += run.answered;
    tally.longest = std::max<double>(tally.longest, run.failed);
    ++tally.runs;
  }
  return tally;
}

std::optional<Absences> FindAbsences(const FailureRuns& failures) {
  const auto ended = Ended(failures);
  if (ended.empty()) return std::nullopt;
  const FailureTally tally = TallyOf(failures);
  // One long outage says nothing about the others.
  const bool others = tally.failed - tally.longest >= kFewest * (tally.runs - 1);
  if (!others || Chance(tally) > kChance) return std::nullopt;
  Duration length{};
  for (const FailureRuns::Run& run : ended) length += LengthOf(run);
  return Absences{ended.size(), length / static_cast<std::int64_t>(ended.size()),
                  PeriodOf(failures.runs())};
}

bool AreAwayTogether(const FailureRuns& one, const FailureRuns& other) {
  const auto lasts = [](const FailureRuns::Run& run) { return run.failed >= kFewest; };
  std::size_t all = 0;
  std::size_t together = 0;
  for (const FailureRuns::Run& run : one.runs()) {
    if (!lasts(run)) continue;
    ++all;
    together += std::ranges::any_of(other.runs(), [&](const FailureRuns::Run& its) {
      return lasts(its) && its.first <= run.last && run.first <= its.last;
    });
  }
  return together >= kOften && 2 * together > all;
}

bool IsUsualSilence(const FailureRuns& failures, Instant now) {
  const auto ended = Ended(failures);
  if (ended.size() < 2 || failures.runs().back().after) return false;
  Duration longest{};
  for (const FailureRuns::Run& run : ended) longest = std::max(longest, LengthOf(run));
  const FailureRuns::Run& open = failures.runs().back();
  return now - open.before.value_or(open.first) <= kUsual * longest;
}

}  // namespace baudgate::control
