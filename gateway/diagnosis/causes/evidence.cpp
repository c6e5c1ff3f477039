// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/causes/evidence.h"

#include <algorithm>
#include <bit>
#include <optional>

#include "gateway/diagnosis/causes/absences.h"

namespace baudgate::control {
namespace {

/// One of so many exchanges that were looked at may have failed.
constexpr std::size_t kMostlyGood = 8;
/// A neighbour fails as often as the device, if it does so at least once in so many times.
constexpr std::size_t kOftenAlike = 4;

void Add(Evidence& evidence, const DeviceRecord& record) {
  const DeviceStatus& status = record.status;
  evidence.records.push_back(&record);
  evidence.answered = evidence.answered || status.last_ok.has_value();
  evidence.looked += status.findings.size();
  evidence.failed += FailedOf(status);
  const Findings::Counts failures = status.findings.Failures();
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

/// Not one of all that are kept was answered.
bool IsAllBad(const Evidence& evidence) {
  const bool fails = evidence.absent || evidence.first().status.unasked;
  return fails && evidence.failed == evidence.looked &&
         evidence.looked == evidence.records.size() * Findings::kKept;
}

constexpr std::size_t kNamed = 2;
/// So close together no two devices fail by themselves.
constexpr Duration kTogether = 5s;

/// Both have answered, and do no more since the same moment.
bool FellTogether(const DeviceStatus& one, const DeviceStatus& other) {
  if (!IsAbsent(one) || !IsAbsent(other) || !one.last_ok || !other.last_ok) return false;
  const Duration between = *one.last_ok - *other.last_ok;
  return between < kTogether && between > -kTogether;
}

/// "d, e and 3 more".
std::string Listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kNamed); ++i) {
    text += (i == 0 ? "" : ", ") + names[i];
  }
  if (names.size() > kNamed) text += " and " + std::to_string(names.size() - kNamed) + " more";
  return text;
}

/// What most of its failures looked like; nothing: too few.
std::optional<Symptom> MostOften(const DeviceStatus& status) {
  const Findings::Counts failures = status.findings.Failures();
  const auto most = std::ranges::max_element(failures);
  if (*most < kFacts) return std::nullopt;
  return static_cast<Symptom>(most - failures.begin());
}

/// Most of its failures are damage, of whichever kinds: noise makes many.
bool ComesDamaged(const DeviceStatus& status) {
  std::size_t damage = 0;
  for (std::size_t i = 0; i < kSymptoms; ++i) {
    const auto symptom = static_cast<Symptom>(i);
    damage += IsDamage(symptom) ? status.findings.Count(symptom) : 0;
  }
  return damage > 1 && 2 * damage > FailedOf(status);
}

/// The latest finding about another master, if the line has two or more.
const Finding* OtherMasterOf(std::span<const DeviceRecord> all) {
  const Finding* found = nullptr;
  std::size_t count = 0;
  for (const DeviceRecord& one : all) {
    for (const Symptom symptom : {Symptom::other_master, Symptom::master_beside}) {
      const std::size_t its = one.status.findings.Count(symptom);
      if (its > 0) found = &one.status.findings.Last(symptom);
      count += its;
    }
  }
  return count > 1 ? found : nullptr;
}

/// For Evidence::eaten.
std::uint8_t EatenBytes(std::span<const DeviceRecord> all) {
  unsigned answered = 0;
  for (const DeviceRecord& one : all) answered |= one.status.findings.specials().AnsweredRequests();
  const unsigned suspects = kFlowBytes & ~answered;
  std::size_t dead = 0;
  unsigned eaten = 0;
  for (const DeviceRecord& one : all) {
    if (!HasDeadQuery(one, kNeverAnswered)) continue;
    for (const QueryCount& query : one.status.queries) {
      // Damaged replies lack such bytes themselves.
      if (query.in_vain < kNeverAnswered || query.symptom != Symptom::silence) continue;
      if ((query.asked & suspects) == 0) return 0;
      eaten |= query.asked & suspects;
      ++dead;
    }
  }
  return static_cast<std::uint8_t>(dead > 1 ? eaten : 0);
}

/// Damage strikes at the same time as silence.
const FailureRuns& RunsOf(const DeviceRecord& record, bool silent) {
  return silent ? record.status.failures : record.status.spoilt;
}

/// Which neighbours fail when the device does. Neighbours are polled in step, and so are requests
/// that fail always: those say nothing.
void AddFailingTogether(Evidence& evidence, std::span<const DeviceRecord> all) {
  const DeviceRecord& device = *evidence.device;
  const bool silent = evidence.Count(Symptom::silence) == evidence.seen;
  std::vector<std::string> away;
  std::vector<std::string> losing;
  std::vector<std::string> names;
  std::vector<const FailureRuns*> failing;
  Coincidences coincidences;
  for (const DeviceRecord& other : all) {
    if (HasDeadQuery(other) || HasDeadQuery(device)) continue;
    if (!other.status.last_ok) continue;  // it fails at all times
    const FailureRuns& own = RunsOf(device, silent);
    const FailureRuns& its = RunsOf(other, silent);
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

config::SerialSettings SerialOf(const DeviceRecord& record) {
  return record.device->serial.value_or(record.line->serial);
}

bool IsAbsent(const DeviceStatus& status) {
  return status.state == DeviceState::offline ||
         (status.state == DeviceState::never_seen && status.exchanges > 0);
}

std::size_t FailedOf(const DeviceStatus& status) {
  std::size_t failed = 0;
  for (std::size_t i = 0; i < kSymptoms; ++i) {
    const auto symptom = static_cast<Symptom>(i);
    if (!IsAnswered(symptom)) failed += status.findings.Count(symptom);
  }
  return failed;
}

/// Where bytes of some come, and not one of others, they share no cause.
bool AbsentTogether(std::span<const DeviceRecord> all) {
  std::size_t absent = 0;
  std::size_t silent = 0;
  std::size_t speaking = 0;
  for (const DeviceRecord& one : all) {
    if (one.status.state == DeviceState::disabled) continue;
    if (!IsAbsent(one.status)) return false;
    ++absent;
    const std::size_t failed = FailedOf(one.status);
    const std::size_t mute = one.status.findings.Count(Symptom::silence);
    silent += failed > 0 && mute == failed ? 1 : 0;
    speaking += 4 * mute < failed ? 1 : 0;
  }
  return absent > 1 && (silent == 0 || speaking == 0);
}

bool IsHealthy(const DeviceStatus& status) {
  if (!Answers(status.state) || status.findings.size() == 0) return false;
  return kMostlyGood * FailedOf(status) <= status.findings.size();
}

bool HasDeadQuery(const DeviceRecord& record, std::uint32_t in_vain) {
  const std::vector<QueryCount>& queries = record.status.queries;
  const auto dead = [&](const QueryCount& query) { return query.in_vain >= in_vain; };
  const auto answered = [](const QueryCount& query) { return query.in_vain == 0; };
  return std::ranges::any_of(queries, dead) && std::ranges::any_of(queries, answered);
}

Evidence Gather(const LineStatus& status, const DeviceRecord& device,
                std::span<const DeviceRecord> all, Now now) {
  Evidence evidence;
  evidence.line = device.line;
  evidence.now = now.instant;
  evidence.status = &status;
  evidence.device = &device;
  evidence.absent = IsAbsent(device.status);
  Add(evidence, device);
  evidence.changed = evidence.answered && IsAllBad(evidence);
  evidence.master = OtherMasterOf(all);
  evidence.eaten = EatenBytes(all);
  std::vector<std::string> fell;
  for (const DeviceRecord& other : all) {
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
    // As often as the device, more or less.
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

bool HasAnsweredLately(const DeviceStatus& status, Instant now) {
  constexpr Duration kLately = 15s;
  return status.last_ok && now - *status.last_ok < kLately;
}

/// Another master may ask the same now and then.
bool Echoes(const LineStatus& status) {
  constexpr std::uint64_t kLooked = 32;
  const auto echoed = static_cast<std::uint64_t>(std::popcount(status.echoed));
  return echoed > 0 && 2 * echoed >= std::min(kLooked, status.exchanges);
}

Evidence GatherAbsent(const LineStatus& status, std::span<const DeviceRecord> all, Now now) {
  Evidence evidence;
  evidence.line = all.front().line;
  evidence.now = now.instant;
  evidence.status = &status;
  evidence.absent = true;
  for (const DeviceRecord& record : all) {
    if (IsAbsent(record.status)) Add(evidence, record);
  }
  evidence.changed = evidence.answered && IsAllBad(evidence);
  return evidence;
}

}  // namespace baudgate::control
