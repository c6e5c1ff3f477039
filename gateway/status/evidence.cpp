// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/evidence.h"

#include <algorithm>
#include <bit>
#include <optional>

#include "gateway/status/absences.h"

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
  for (std::size_t i = 0; i < kSymptoms; ++i) {
    const auto symptom = static_cast<Symptom>(i);
    const std::size_t count = status.findings.Count(symptom);
    evidence.counts[i] += count;
    if (!IsAnswered(symptom)) evidence.failed += count;
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
  std::optional<Symptom> most;
  std::size_t best = 1;
  for (std::size_t i = 0; i < kSymptoms; ++i) {
    const auto symptom = static_cast<Symptom>(i);
    const std::size_t count = IsAnswered(symptom) ? 0 : status.findings.Count(symptom);
    if (count <= best) continue;
    best = count;
    most = symptom;
  }
  return most;
}

}  // namespace

std::size_t Evidence::Count(std::initializer_list<Symptom> symptoms) const {
  std::size_t count = 0;
  for (const Symptom symptom : symptoms) count += Count(symptom);
  return count;
}

double Evidence::Share(std::initializer_list<Symptom> symptoms) const {
  return failed == 0 ? 0 : static_cast<double>(Count(symptoms)) / static_cast<double>(failed);
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
  std::vector<std::string> fell;
  std::vector<std::string> away;
  std::vector<std::string> losing;
  Coincidences coincidences;
  std::vector<const FailureRuns*> failing;
  std::vector<std::string> failing_names;
  for (const DeviceRecord& other : all) {
    const FailureRuns& failures = other.status.failures;
    if (!failures.runs().empty()) failing.push_back(&failures);
    if (other.device == device.device) continue;
    if (!failures.runs().empty()) failing_names.push_back(other.device->name);
    if (FellTogether(device.status, other.status)) fell.push_back(other.device->name);
    if (AreAwayTogether(device.status.failures, other.status.failures)) {
      away.push_back(other.device->name);
    }
    const auto both = CoincidencesOf(device.status.failures, other.status.failures);
    coincidences.Add(both);
    if (2 * both.together > both.all) losing.push_back(other.device->name);
    const auto own = MostOften(device.status);
    const bool alike = own && own == MostOften(other.status);
    if (alike) evidence.alike = other.device->name;
    // As often as the device, more or less.
    const bool as_often = alike && kOftenAlike * FailedOf(other.status) >= evidence.failed;
    if (IsHealthy(other.status) && !as_often && evidence.healthy.empty()) {
      evidence.healthy = other.device->name;
    }
  }
  if (!evidence.healthy.empty()) evidence.alike.clear();
  evidence.fell = Listed(fell);
  evidence.away = Listed(away);
  evidence.shared_period = SharedPeriod(failing);
  if (evidence.shared_period) {
    evidence.losing = Listed(failing_names);
  } else if (coincidences.AreNoChance()) {
    evidence.losing = Listed(losing);
  }
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
