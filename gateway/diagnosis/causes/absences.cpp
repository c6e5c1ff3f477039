// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/causes/absences.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <vector>

namespace baudgate::control {
namespace {

/// If single losses are this unlikely to stand so close together, they are outages.
constexpr double kChance = 0.001;
/// An outage has at least this many failures on average: the request and its repeat.
constexpr double kFewest = 2;
/// A single outage that has this many times the failures of all others stands for itself.
constexpr double kMostly = 4;
/// This many coincidences are no chance.
constexpr std::size_t kOften = 2;
/// Devices are asked one after the other.
constexpr Duration kNextTurn = 1s;
/// Failures this close together belong to one outage.
constexpr Duration kSameOutage = 3s;
/// Fewer failures at the same time may be chance.
constexpr std::size_t kFewTogether = 3;
/// A period needs this many beginnings, and its longest is at most this many times its shortest.
constexpr std::size_t kBeginnings = 3;
constexpr double kRegular = 1.4;
/// So many single failures with so many answers between them come with a period by no chance.
constexpr std::size_t kManyBeginnings = 5;
constexpr std::uint32_t kRare = 5;
/// Failures with a shorter period are single losses.
constexpr Duration kShortestPeriod = 4s;
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

/// The probability that this many or more of `all` happen, each by `chance`.
double AtLeast(std::size_t some, std::size_t all, double chance) {
  double sum = 0;
  for (std::size_t i = some; i <= all; ++i) {
    const auto count = static_cast<double>(i);
    const auto rest = static_cast<double>(all - i);
    sum += std::exp(LogWays(static_cast<double>(all), count) + count * std::log(chance) +
                    rest * std::log1p(-chance));
  }
  return sum;
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

/// Failures that are rare and regular are short outages.
bool ComeRegularly(const FailureRuns& failures) {
  const auto& runs = failures.runs();
  const auto is_rare = [](const FailureRuns::Run& run) { return run.answered >= kRare; };
  const Duration period = PeriodOf(runs).value_or(Duration());
  return runs.size() >= kManyBeginnings && period >= kShortestPeriod &&
         std::all_of(runs.begin() + 1, runs.end(), is_rare);
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
  // One long outage says nothing about the others, unless they are few.
  const double others = tally.failed - tally.longest;
  const bool alike = others >= kFewest * (tally.runs - 1);
  const bool over = failures.runs().back().after.has_value();
  const bool alone = !alike && over && tally.longest >= kMostly * others;
  const bool unlikely = (alike || alone) && Chance(tally) <= kChance;
  if (!unlikely && !ComeRegularly(failures)) return std::nullopt;
  if (unlikely && alone) {
    return Absences{1, LengthOf(*std::ranges::max_element(ended, {}, &FailureRuns::Run::failed))};
  }
  Duration length{};
  for (const FailureRuns::Run& run : ended) length += LengthOf(run);
  return Absences{ended.size(), length / static_cast<std::int64_t>(ended.size()),
                  PeriodOf(failures.runs())};
}

Coincidences CoincidencesOf(const FailureRuns& one, const FailureRuns& other) {
  const std::vector<FailureRuns::Run> own = Ended(one);
  const std::vector<FailureRuns::Run> its = Ended(other);
  Coincidences found;
  if (own.empty() || its.empty()) return found;
  const auto begin = [](const FailureRuns::Run& run) { return run.before.value_or(run.first); };
  const Instant from = std::max(begin(own.front()), begin(its.front()));
  const Instant to = std::min(*own.back().after, *its.back().after);
  if (from >= to) return found;
  Duration failing{};
  for (const FailureRuns::Run& run : its) {
    failing += std::max(Duration(), std::min(*run.after, to) - std::max(begin(run), from));
  }
  for (const FailureRuns::Run& run : own) {
    if (run.first < from || run.first > to) continue;
    ++found.all;
    found.together += std::ranges::any_of(its, [&](const FailureRuns::Run& that) {
      return begin(that) < run.first && run.first < *that.after;
    });
  }
  found.expected = static_cast<double>(found.all) * static_cast<double>(failing.count()) /
                   static_cast<double>((to - from).count());
  return found;
}

bool Coincidences::AreNoChance() const {
  if (together < kFewTogether || expected >= static_cast<double>(all)) return false;
  return AtLeast(together, all, expected / static_cast<double>(all)) < kChance;
}

bool AreAwayTogether(const FailureRuns& one, const FailureRuns& other) {
  const auto lasts = [](const FailureRuns::Run& run) { return run.failed >= kFewest; };
  std::size_t all = 0;
  std::size_t together = 0;
  std::set<const FailureRuns::Run*> others;  // a long one may stand beside several
  for (const FailureRuns::Run& run : one.runs()) {
    if (!lasts(run)) continue;
    ++all;
    const auto beside = std::ranges::find_if(other.runs(), [&](const FailureRuns::Run& its) {
      return lasts(its) && its.first <= run.last + kNextTurn && run.first <= its.last + kNextTurn;
    });
    if (beside == other.runs().end()) continue;
    ++together;
    others.insert(&*beside);
  }
  return others.size() >= kOften && 2 * together > all;
}

std::optional<Duration> SharedPeriod(std::span<const FailureRuns* const> devices) {
  std::vector<FailureRuns::Run> runs;
  for (const FailureRuns* const one : devices) {
    runs.insert(runs.end(), one->runs().begin(), one->runs().end());
  }
  std::ranges::sort(runs, {}, &FailureRuns::Run::first);
  std::vector<FailureRuns::Run> outages;
  for (const FailureRuns::Run& run : runs) {
    if (outages.empty() || run.first - outages.back().last > kSameOutage) {
      outages.push_back(run);
    } else {
      outages.back().last = std::max(outages.back().last, run.last);
    }
  }
  if (outages.size() < kManyBeginnings) return std::nullopt;
  // If one device has all of these outages and the others hardly any, they are not shared.
  const auto has_many = [&](const FailureRuns* one) {
    return 2 * one->runs().size() >= outages.size();
  };
  const auto has_all = [&](const FailureRuns* one) { return one->runs().size() >= outages.size(); };
  const bool own =
      std::ranges::any_of(devices, has_all) && std::ranges::count_if(devices, has_many) < 2;
  return own ? std::nullopt : PeriodOf(outages);
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
