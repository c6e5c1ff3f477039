// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/causes/evidence.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <set>
#include <vector>

namespace baudgate::diagnosis {
namespace {

/// Failures count as outages if random losses would be this close together with at most this
/// probability.
constexpr double kChance = 0.001;
/// An outage has at least this many failures on average: a request and its retry.
constexpr double kFewest = 2;

/// A single outage is reported if it has this many times the failures of all other runs together.
constexpr double kMostly = 4;
/// If runs of failures of two devices coincide this often, it is not chance.
constexpr std::size_t kOften = 2;

/// Failures of two devices less than this time apart count as simultaneous, because devices are
/// polled one after the other.
constexpr Duration kNextTurn = 1s;
/// Failures of several devices less than this time apart belong to one outage.
constexpr Duration kSameOutage = 3s;

/// Fewer runs of failures of several devices at the same time may be chance.
constexpr std::size_t kFewTogether = 3;
/// Outages have a period if there are at least this many, and the longest time between two is at
/// most kRegular times the shortest.
constexpr std::size_t kBeginnings = 3;
constexpr double kRegular = 1.4;
/// Single failures are regular outages if there are at least kManyBeginnings of them, with kRare
/// answers between them.
constexpr std::size_t kManyBeginnings = 5;
constexpr std::uint32_t kRare = 5;
/// Regular failures with a shorter period than this are single losses.
constexpr Duration kShortestPeriod = 4s;

/// A silence longer than this many times the longest before is a new trouble.
constexpr double kUsual = 2;

/// Returns the logarithm of the number of ways to choose `some` of `all` things.
double LogWays(double all, double some) {
  double ways = 0;
  for (double i = 1; i <= some; ++i) ways += std::log((all - some + i) / i);
  return ways;
}

/// Returns the probability that independent failures form at most this many runs (runs test of Wald
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

/// Returns the probability that at least `some` of `all` events happen, if each happens with the
/// probability `chance`.
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

/// Returns the estimated length of an outage: the mean of its shortest (first to last failure) and
/// its longest possible length (answer before to answer after).
Duration LengthOf(const bus::FailureRuns::Run& run) {
  const Duration least = run.last - run.first;
  const Duration most = *run.after - run.before.value_or(run.first);
  return (least + most) / 2;
}

std::vector<bus::FailureRuns::Run> Ended(const bus::FailureRuns& failures) {
  std::vector<bus::FailureRuns::Run> ended;
  std::ranges::copy_if(failures.runs(), std::back_inserter(ended),
                       [](const bus::FailureRuns::Run& run) { return run.after.has_value(); });
  return ended;
}

std::optional<Duration> PeriodOf(const std::vector<bus::FailureRuns::Run>& runs) {
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

/// True if the failures are rare and come at regular times: then they are short outages.
bool ComeRegularly(const bus::FailureRuns& failures) {
  const auto& runs = failures.runs();
  const auto is_rare = [](const bus::FailureRuns::Run& run) { return run.answered >= kRare; };
  const Duration period = PeriodOf(runs).value_or(Duration());
  return runs.size() >= kManyBeginnings && period >= kShortestPeriod &&
         std::all_of(runs.begin() + 1, runs.end(), is_rare);
}

}  // namespace

FailureTally TallyOf(const bus::FailureRuns& failures) {
  FailureTally tally;
  tally.answered = failures.answered();
  for (const bus::FailureRuns::Run& run : failures.runs()) {
    tally.failed += run.failed;
    tally.answered += run.answered;
    tally.longest = std::max<double>(tally.longest, run.failed);
    ++tally.runs;
  }
  return tally;
}

std::optional<Absences> FindAbsences(const bus::FailureRuns& failures) {
  const auto ended = Ended(failures);
  if (ended.empty()) return std::nullopt;
  const FailureTally tally = TallyOf(failures);
  // One long outage does not show that the other failures are outages. It is reported alone if
  // there are few others.
  const double others = tally.failed - tally.longest;
  const bool alike = others >= kFewest * (tally.runs - 1);
  const bool over = failures.runs().back().after.has_value();
  const bool alone = !alike && over && tally.longest >= kMostly * others;
  const bool unlikely = (alike || alone) && Chance(tally) <= kChance;
  if (!unlikely && !ComeRegularly(failures)) return std::nullopt;
  if (unlikely && alone) {
    return Absences{1,
                    LengthOf(*std::ranges::max_element(ended, {}, &bus::FailureRuns::Run::failed))};
  }
  Duration length{};
  for (const bus::FailureRuns::Run& run : ended) length += LengthOf(run);
  return Absences{ended.size(), length / static_cast<std::int64_t>(ended.size()),
                  PeriodOf(failures.runs())};
}

Coincidences CoincidencesOf(const bus::FailureRuns& one, const bus::FailureRuns& other) {
  const std::vector<bus::FailureRuns::Run> own = Ended(one);
  const std::vector<bus::FailureRuns::Run> its = Ended(other);
  Coincidences found;
  if (own.empty() || its.empty()) return found;
  const auto begin = [](const bus::FailureRuns::Run& run) {
    return run.before.value_or(run.first);
  };
  const Instant from = std::max(begin(own.front()), begin(its.front()));
  const Instant to = std::min(*own.back().after, *its.back().after);
  if (from >= to) return found;
  Duration failing{};
  for (const bus::FailureRuns::Run& run : its) {
    failing += std::max(Duration(), std::min(*run.after, to) - std::max(begin(run), from));
  }
  for (const bus::FailureRuns::Run& run : own) {
    if (run.first < from || run.first > to) continue;
    ++found.all;
    found.together += std::ranges::any_of(its, [&](const bus::FailureRuns::Run& that) {
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

bool AreAwayTogether(const bus::FailureRuns& one, const bus::FailureRuns& other) {
  const auto lasts = [](const bus::FailureRuns::Run& run) { return run.failed >= kFewest; };
  std::size_t all = 0;
  std::size_t together = 0;
  // The runs of `other` that coincide, each once: a long run can coincide with several runs of
  // `one`.
  std::set<const bus::FailureRuns::Run*> others;
  for (const bus::FailureRuns::Run& run : one.runs()) {
    if (!lasts(run)) continue;
    ++all;
    const auto beside = std::ranges::find_if(other.runs(), [&](const bus::FailureRuns::Run& its) {
      return lasts(its) && its.first <= run.last + kNextTurn && run.first <= its.last + kNextTurn;
    });
    if (beside == other.runs().end()) continue;
    ++together;
    others.insert(&*beside);
  }
  return others.size() >= kOften && 2 * together > all;
}

std::optional<Duration> SharedPeriod(std::span<const bus::FailureRuns* const> devices) {
  std::vector<bus::FailureRuns::Run> runs;
  for (const bus::FailureRuns* const one : devices) {
    runs.insert(runs.end(), one->runs().begin(), one->runs().end());
  }
  std::ranges::sort(runs, {}, &bus::FailureRuns::Run::first);
  std::vector<bus::FailureRuns::Run> outages;
  for (const bus::FailureRuns::Run& run : runs) {
    if (outages.empty() || run.first - outages.back().last > kSameOutage) {
      outages.push_back(run);
    } else {
      outages.back().last = std::max(outages.back().last, run.last);
    }
  }
  if (outages.size() < kManyBeginnings) return std::nullopt;
  // If one device has all these outages and no second device has many, they are not shared.
  const auto has_many = [&](const bus::FailureRuns* one) {
    return 2 * one->runs().size() >= outages.size();
  };
  const auto has_all = [&](const bus::FailureRuns* one) {
    return one->runs().size() >= outages.size();
  };
  const bool own =
      std::ranges::any_of(devices, has_all) && std::ranges::count_if(devices, has_many) < 2;
  return own ? std::nullopt : PeriodOf(outages);
}

bool IsUsualSilence(const bus::FailureRuns& failures, Instant now) {
  const auto ended = Ended(failures);
  if (ended.size() < 2 || failures.runs().back().after) return false;
  Duration longest{};
  for (const bus::FailureRuns::Run& run : ended) longest = std::max(longest, LengthOf(run));
  const bus::FailureRuns::Run& open = failures.runs().back();
  return now - open.before.value_or(open.first) <= kUsual * longest;
}

namespace {

/// A device is healthy if at most one of this many exchanges failed.
constexpr std::size_t kMostlyGood = 8;
/// A neighbour fails as often as the device if it has at least 1 / kOftenAlike of the device's
/// failures.
constexpr std::size_t kOftenAlike = 4;

void Add(Evidence& evidence, const bus::DeviceRecord& record) {
  const bus::DeviceStatus& status = record.status;
  evidence.records.push_back(&record);
  evidence.answered = evidence.answered || status.last_ok.has_value();
  evidence.looked += status.findings.size();
  evidence.failed += FailedOf(status);
  const bus::Findings::Counts failures = status.findings.Failures();
  for (std::size_t i = 0; i < kSymptoms; ++i) {
    const auto symptom = static_cast<Symptom>(i);
    const std::size_t count = IsAnswered(symptom) ? status.findings.Count(symptom) : failures[i];
    evidence.counts[i] += count;
    evidence.seen += failures[i];
    if (count > 0 || evidence.last[i] == nullptr) {
      evidence.last[i] = &status.findings.Last(symptom);
    }
  }
}

bool IsAllBad(const Evidence& evidence) {
  const bool fails = evidence.absent || evidence.first().status.unasked;
  return fails && evidence.failed == evidence.looked &&
         evidence.looked == evidence.records.size() * bus::Findings::kKept;
}

constexpr std::size_t kNamed = 2;
/// Devices that stop answering less than this time apart have a common cause.
constexpr Duration kTogether = 5s;

bool FellTogether(const bus::DeviceStatus& one, const bus::DeviceStatus& other) {
  if (!IsAbsent(one) || !IsAbsent(other) || !one.last_ok || !other.last_ok) return false;
  const Duration between = *one.last_ok - *other.last_ok;
  return between < kTogether && between > -kTogether;
}

/// Returns the first names, such as "d, e and 3 more".
std::string Listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kNamed); ++i) {
    text += (i == 0 ? "" : ", ") + names[i];
  }
  if (names.size() > kNamed) text += " and " + std::to_string(names.size() - kNamed) + " more";
  return text;
}

/// Returns the most frequent symptom of the failures; nothing: it was found less than kFacts times.
std::optional<Symptom> MostOften(const bus::DeviceStatus& status) {
  const bus::Findings::Counts failures = status.findings.Failures();
  const auto most = std::ranges::max_element(failures);
  if (*most < kFacts) return std::nullopt;
  return static_cast<Symptom>(most - failures.begin());
}

/// True if most failures are damaged replies of any kind. (Noise causes several kinds.)
bool ComesDamaged(const bus::DeviceStatus& status) {
  std::size_t damage = 0;
  for (std::size_t i = 0; i < kSymptoms; ++i) {
    const auto symptom = static_cast<Symptom>(i);
    damage += IsDamage(symptom) ? status.findings.Count(symptom) : 0;
  }
  return damage > 1 && 2 * damage > FailedOf(status);
}

/// Returns the latest finding about another master; null: the devices of the line have fewer than
/// two such findings.
const Finding* OtherMasterOf(std::span<const bus::DeviceRecord> all) {
  const Finding* found = nullptr;
  std::size_t count = 0;
  for (const bus::DeviceRecord& one : all) {
    for (const Symptom symptom : {Symptom::other_master, Symptom::master_beside}) {
      const std::size_t its = one.status.findings.Count(symptom);
      if (its > 0) found = &one.status.findings.Last(symptom);
      count += its;
    }
  }
  return count > 1 ? found : nullptr;
}

/// Returns the bytes for Evidence::eaten: XON or XOFF that a converter seems to remove from
/// requests.
std::uint8_t EatenBytes(std::span<const bus::DeviceRecord> all) {
  unsigned answered = 0;
  for (const bus::DeviceRecord& one : all)
    answered |= one.status.findings.specials().AnsweredRequests();
  const unsigned suspects = kFlowBytes & ~answered;
  std::size_t dead = 0;
  unsigned eaten = 0;
  for (const bus::DeviceRecord& one : all) {
    if (!HasDeadQuery(one, kNeverAnswered)) continue;
    for (const bus::QueryCount& query : one.status.queries) {
      // A reply, even a damaged one, proves that the request has arrived, so only silence counts.
      if (query.in_vain < kNeverAnswered || query.symptom != Symptom::silence) continue;
      if ((query.asked & suspects) == 0) return 0;
      eaten |= query.asked & suspects;
      ++dead;
    }
  }
  return static_cast<std::uint8_t>(dead > 1 ? eaten : 0);
}

/// Returns the runs of failures to compare with those of neighbours: runs of silence if the device
/// is only silent; else runs in which damaged replies count as failures too.
const bus::FailureRuns& RunsOf(const bus::DeviceRecord& record, bool silent) {
  return silent ? record.status.failures : record.status.spoilt;
}

/// Finds neighbours that fail when the device fails. Devices with a request that always fails are
/// left out: polls have the same rhythm, so the failures would coincide by chance.
void AddFailingTogether(Evidence& evidence, std::span<const bus::DeviceRecord> all) {
  const bus::DeviceRecord& device = *evidence.device;
  const bool silent = evidence.Count(Symptom::silence) == evidence.seen;
  std::vector<std::string> away;
  std::vector<std::string> losing;
  std::vector<std::string> names;
  std::vector<const bus::FailureRuns*> failing;
  Coincidences coincidences;
  for (const bus::DeviceRecord& other : all) {
    if (HasDeadQuery(other) || HasDeadQuery(device)) continue;
    if (!other.status.last_ok) continue;  // a device that never answered fails at all times
    const bus::FailureRuns& own = RunsOf(device, silent);
    const bus::FailureRuns& its = RunsOf(other, silent);
    if (!its.runs().empty()) failing.push_back(&its);
    if (other.device == device.device) continue;
    if (!its.runs().empty()) names.push_back(other.device->name);
    if (AreAwayTogether(own, its)) away.push_back(other.device->name);
    const auto both = CoincidencesOf(own, its);
    coincidences.Add(both);
    if (2 * both.together > both.all) losing.push_back(other.device->name);
  }
  evidence.away = Listed(away);
  evidence.shared_period = SharedPeriod(failing);
  if (evidence.shared_period) {
    evidence.losing = Listed(names);
  } else if (coincidences.AreNoChance()) {
    evidence.losing = Listed(losing);
  }
}

bool IsHealthy(const bus::DeviceStatus& status) {
  if (!Answers(status.state) || status.findings.size() == 0) return false;
  return kMostlyGood * FailedOf(status) <= status.findings.size();
}

}  // namespace

std::size_t Evidence::Count(std::initializer_list<Symptom> symptoms) const {
  std::size_t count = 0;
  for (const Symptom symptom : symptoms) count += Count(symptom);
  return count;
}

double Evidence::Share(std::initializer_list<Symptom> symptoms) const {
  return seen == 0 ? 0 : static_cast<double>(Count(symptoms)) / static_cast<double>(seen);
}

double Evidence::Share(std::initializer_list<Symptom> own, std::initializer_list<Symptom> others,
                       std::size_t most) const {
  const bool same = Count(others) <= most * Count(own);
  return Share(own) + (same ? Share(others) : 0);
}

bool IsDamage(Symptom symptom) {
  using enum Symptom;
  constexpr Symptom kDamage[] = {head_lost, end_lost, tail_lost, bytes_lost, bytes_added,
                                 bad_check, damaged,  noise,     zeros};
  return std::ranges::find(kDamage, symptom) != std::end(kDamage);
}

config::SerialSettings SerialOf(const bus::DeviceRecord& record) {
  return record.device->serial.value_or(record.line->serial);
}

bool IsAbsent(const bus::DeviceStatus& status) {
  return status.state == bus::DeviceState::offline ||
         (status.state == bus::DeviceState::never_seen && status.exchanges > 0);
}

std::size_t FailedOf(const bus::DeviceStatus& status) {
  std::size_t failed = 0;
  for (std::size_t i = 0; i < kSymptoms; ++i) {
    const auto symptom = static_cast<Symptom>(i);
    if (!IsAnswered(symptom)) failed += status.findings.Count(symptom);
  }
  return failed;
}

/// Devices that are silent and devices that send bytes fail for different reasons, so a mixture
/// returns false.
bool AbsentTogether(std::span<const bus::DeviceRecord> all) {
  std::size_t absent = 0;
  std::size_t silent = 0;
  std::size_t speaking = 0;
  for (const bus::DeviceRecord& one : all) {
    if (one.status.state == bus::DeviceState::disabled) continue;
    if (!IsAbsent(one.status)) return false;
    ++absent;
    const std::size_t failed = FailedOf(one.status);
    const std::size_t mute = one.status.findings.Count(Symptom::silence);
    silent += failed > 0 && mute == failed ? 1 : 0;
    speaking += 4 * mute < failed ? 1 : 0;
  }
  return absent > 1 && (silent == 0 || speaking == 0);
}

bool HasDeadQuery(const bus::DeviceRecord& record, std::uint32_t in_vain) {
  const std::vector<bus::QueryCount>& queries = record.status.queries;
  const auto dead = [&](const bus::QueryCount& query) { return query.in_vain >= in_vain; };
  const auto answered = [](const bus::QueryCount& query) { return query.in_vain == 0; };
  return std::ranges::any_of(queries, dead) && std::ranges::any_of(queries, answered);
}

Evidence Gather(const bus::LineStatus& status, const bus::DeviceRecord& device,
                std::span<const bus::DeviceRecord> all, Now now) {
  Evidence evidence;
  evidence.line = device.line.get();
  evidence.now = now.instant;
  evidence.status = &status;
  evidence.device = &device;
  evidence.absent = IsAbsent(device.status);
  Add(evidence, device);
  evidence.changed = evidence.answered && IsAllBad(evidence);
  evidence.master = OtherMasterOf(all);
  evidence.eaten = EatenBytes(all);
  std::vector<std::string> fell;
  for (const bus::DeviceRecord& other : all) {
    if (other.device == device.device) continue;
    const std::size_t mute = other.status.findings.Count(Symptom::silence);
    if (!other.status.last_ok && mute > 1 && mute == other.status.findings.size()) {
      evidence.missing = other.device->name;
    }
    if (FellTogether(device.status, other.status)) fell.push_back(other.device->name);
    const auto own = MostOften(device.status);
    const bool alike = own && own == MostOften(other.status);
    if (alike) evidence.alike = other.device->name;
    const bool damaged = ComesDamaged(device.status) && ComesDamaged(other.status);
    const bool as_often =
        (alike || damaged) && kOftenAlike * FailedOf(other.status) >= evidence.failed;
    evidence.noisy = evidence.noisy || (damaged && as_often);
    if (IsHealthy(other.status) && !as_often && evidence.healthy.empty()) {
      evidence.healthy = other.device->name;
    }
  }
  if (!evidence.healthy.empty()) evidence.alike.clear();
  evidence.fell = Listed(fell);
  AddFailingTogether(evidence, all);
  return evidence;
}

bool HasAnsweredLately(const bus::DeviceStatus& status, Instant now) {
  constexpr Duration kLately = 15s;
  return status.last_ok && now - *status.last_ok < kLately;
}

/// True if at least half of the latest requests came back. Fewer may come from another master that
/// sends identical requests.
bool Echoes(const bus::LineStatus& status) {
  constexpr std::uint64_t kLooked = 32;
  const auto echoed = static_cast<std::uint64_t>(std::popcount(status.echoed));
  return echoed > 0 && 2 * echoed >= std::min(kLooked, status.exchanges);
}

Evidence GatherAbsent(const bus::LineStatus& status, std::span<const bus::DeviceRecord> all,
                      Now now) {
  Evidence evidence;
  evidence.line = all.front().line.get();
  evidence.now = now.instant;
  evidence.status = &status;
  evidence.absent = true;
  for (const bus::DeviceRecord& record : all) {
    if (IsAbsent(record.status)) Add(evidence, record);
  }
  evidence.changed = evidence.answered && IsAllBad(evidence);
  return evidence;
}

}  // namespace baudgate::diagnosis
