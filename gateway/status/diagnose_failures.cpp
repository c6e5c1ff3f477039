// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/diagnose_failures.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "gateway/base/shown.h"
#include "gateway/status/hypotheses.h"
#include "gateway/status/reason.h"

namespace baudgate::control {
namespace {

using Sentences = std::vector<std::string>;

/// A request that has failed so often in a row, beside others that are answered.
constexpr std::uint32_t kNeverAnswered = 3;

/// "3 damaged, 2 late": what its failures looked like.
std::string Looks(const Evidence& evidence) {
  std::string text;
  for (std::size_t i = 0; i < kSymptoms; ++i) {
    const auto symptom = static_cast<Symptom>(i);
    if (IsAnswered(symptom) || evidence.Count(symptom) == 0) continue;
    std::string word(Name(symptom));
    std::ranges::replace(word, '_', ' ');
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", evidence.Count(symptom), word);
  }
  return text;
}

/// "voltage and 3 more": what the requests read for which `is_meant` holds; empty: there are none,
/// or all are.
template <typename IsMeant>
std::string NamesOf(const DeviceRecord& record, IsMeant is_meant) {
  const std::vector<QueryCount>& queries = record.status.queries;
  std::string first;
  std::size_t points = 0;
  std::size_t meant = 0;
  for (const QueryCount& query : queries) {
    if (!is_meant(query)) continue;
    ++meant;
    points += query.points;
    if (!first.empty() || query.first_point >= record.device->points.size()) continue;
    first = record.device->points[query.first_point].name;
  }
  if (meant == queries.size() || first.empty()) return {};
  return points > 1 ? fmt::format("{} and {} more", first, points - 1) : first;
}

/// It came, and is no reply as it is.
bool IsDamage(Symptom symptom) {
  using enum Symptom;
  constexpr Symptom kDamage[] = {head_lost, end_lost, tail_lost, bytes_lost, bytes_added,
                                 bad_check, damaged,  noise,     zeros};
  return std::ranges::find(kDamage, symptom) != std::end(kDamage);
}

/// Requests that are never answered well, beside others that are.
Sentences DeadQueries(const DeviceRecord& record, const Evidence& evidence) {
  const DeviceStatus& status = record.status;
  const auto fails = [](const QueryCount& query) { return query.in_vain >= kNeverAnswered; };
  const bool others = std::ranges::any_of(status.queries, [](const QueryCount& query) {
    return query.points > 0 && query.in_vain == 0;
  });
  // Where others fail now and then as well, it is no matter of the request.
  const bool shaky = std::ranges::any_of(status.queries, [&](const QueryCount& query) {
    return !fails(query) && std::popcount(query.failures) > 1;
  });
  if (!others || shaky || status.findings.Count(Symptom::late) > 0) return {};
  const std::string points = NamesOf(record, fails);
  if (points.empty()) return {};
  const bool silent = std::ranges::all_of(status.queries, [&](const QueryCount& query) {
    return !fails(query) || query.symptom == Symptom::silence;
  });
  if (silent) {
    return {"does not answer the request for " + points +
            ", and answers the others: take these points out of the profile, or set access: none"};
  }
  const bool damaged = std::ranges::all_of(status.queries, [&](const QueryCount& query) {
    return !fails(query) || IsDamage(query.symptom);
  });
  const auto judged = Judge(evidence);
  if (!judged.empty() && judged.front()->whole) return Said("", evidence);
  if (damaged && status.findings.Suspects() == 0) {
    return {"the replies for " + points +
            " come damaged, and no others: take these points out of the profile, or set the "
            "converter in between to raw"};
  }
  const bool shifted = evidence.Count(Symptom::one_behind) > 0;  // and that would shift all
  const std::string before = "only the request for " + points + " fails: ";
  if (!shifted && !judged.empty()) return Said(before, evidence);
  return {before + "its reply does not fit (" + Shortened(status.last_reason) +
          "): does the profile fit the device?"};
}

/// How often it fails at present; empty: not often enough for a word.
std::string HowOften(const Evidence& evidence) {
  if (evidence.failed < kNotableFailures) return {};
  return fmt::format("{} of {} exchanges failed: ", evidence.failed, evidence.looked);
}

/// What it says in place of values: one reason for all that it refuses.
std::string Refusals(const DeviceRecord& record, const Evidence& evidence) {
  const std::size_t count = evidence.Count(Symptom::refusal);
  if (count < kNotableFailures) return {};
  const Finding& last = evidence.Last(Symptom::refusal);
  const std::string reason =
      last.cause.empty() ? std::string(Name(record.status.last_outcome)) : Brief(last);
  const std::string points =
      NamesOf(record, [](const QueryCount& query) { return query.refused >= kNeverAnswered; });
  if (record.status.unasked) {
    return fmt::format("{} ({} of its last {} messages): {}", reason, count, evidence.looked,
                       RemedyOf(last));
  }
  return fmt::format("it says '{}' to {} of {} requests{}: {}", reason, count, evidence.looked,
                     points.empty() ? "" : " (" + points + ")", RemedyOf(last));
}

}  // namespace

Sentences Said(const std::string& before, const Evidence& evidence) {
  const auto judged = Judge(evidence);
  if (judged.empty()) {
    const std::string looks = Looks(evidence);
    return {before + "no cause stands out" + (looks.empty() ? "" : " (" + looks + ")") +
            ": look at 'baudgate trace " + evidence.line->name + "'"};
  }
  Sentences said = Besides(evidence, judged);
  said.insert(said.begin(), before + judged.front()->say(evidence));
  return said;
}

Sentences Failures(const DeviceRecord& record, const Evidence& evidence) {
  Sentences found = DeadQueries(record, evidence);
  const std::string often = HowOften(evidence);
  if (!often.empty() && found.empty()) {
    found = Said(often, evidence);
  }
  const std::vector<QueryCount>& queries = record.status.queries;
  const bool none = !queries.empty() && std::ranges::all_of(queries, [](const QueryCount& query) {
    return query.points == 0 || query.in_vain > 0;
  });
  // Probes may be answered well, and there are more of them.
  if (found.empty() && none && evidence.failed > 0) {
    found = Said("it answers, and its polls fail: ", evidence);
  }
  if (std::string refusals = Refusals(record, evidence); !refusals.empty()) {
    const bool more = evidence.Count(Symptom::refusal) > evidence.failed;
    found.insert(more ? found.begin() : found.end(), std::move(refusals));
  }
  return found;
}

}  // namespace baudgate::control
