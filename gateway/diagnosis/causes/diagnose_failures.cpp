// Sentences about exchanges that failed and about requests that a device refuses. diagnose.h
// describes the functions.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/diagnosis/causes/diagnose.h"
#include "gateway/diagnosis/causes/evidence.h"
#include "gateway/diagnosis/causes/hypotheses.h"
#include "gateway/diagnosis/causes/words.h"

namespace baudgate::diagnosis {
namespace {

using Sentences = std::vector<std::string>;

/// Rare failures are reported if there are this many runs of failures (bus::FailureRuns), and at
/// least this share of all exchanges failed.
constexpr double kManyRuns = 5;
constexpr double kNotableLosses = 0.03;
/// If this many requests in a row were refused, the device is not only busy for a moment.
constexpr std::size_t kAlways = 8;

/// Returns the symptoms of the failures and their numbers, such as "3 damaged, 2 late".
std::string Looks(const Evidence& evidence) {
  std::string text;
  for (std::size_t i = 0; i < kSymptoms; ++i) {
    const auto symptom = static_cast<Symptom>(i);
    if (IsAnswered(symptom) || evidence.Count(symptom) == 0) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", evidence.Count(symptom),
                        InWords(Name(symptom)));
  }
  return text;
}

/// Returns the points of the queries for which `is_meant` is true, such as "voltage and 3 more".
/// Empty: `is_meant` is true for no query; or for all queries, unless `all` is set.
template <typename IsMeant>
std::string NamesOf(const bus::DeviceRecord& record, IsMeant is_meant, bool all = false) {
  const std::vector<bus::QueryCount>& queries = record.status.queries;
  std::string first;
  std::size_t points = 0;
  std::size_t meant = 0;
  for (const bus::QueryCount& query : queries) {
    if (!is_meant(query)) continue;
    ++meant;
    points += query.points;
    if (!first.empty() || query.first_point >= record.device->points.size()) continue;
    first = record.device->points[query.first_point].name;
  }
  if ((meant == queries.size() && !all) || first.empty()) return {};
  return points > 1 ? fmt::format("{} and {} more", first, points - 1) : first;
}

/// Returns the points for which `is_meant` is true, with the address of the first, such as "voltage
/// and 3 more (holding 40, ...)". Empty: `is_meant` is true for no point, or for all points.
template <typename IsMeant>
std::string PointsOf(const bus::DeviceRecord& record, IsMeant is_meant) {
  const config::Point* first = nullptr;
  std::size_t points = 0;
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    if (!is_meant(i)) continue;
    if (first == nullptr) first = &record.device->points[i];
    ++points;
  }
  if (first == nullptr || points == record.points.size()) return {};
  const std::string more = points > 1 ? fmt::format(" and {} more", points - 1) : std::string();
  return first->name + more + " (" + first->read + (points > 1 ? ", ...)" : ")");
}

/// True if there were several failures (at least kNeverAnswered), and each lasted through all
/// retries of its request. Random failures would not.
bool FailsWithRepeats(const Evidence& evidence) {
  const bus::Findings& findings = evidence.device->status.findings;
  const std::size_t longest = findings.LongestRun();
  const std::size_t runs = findings.Runs();
  return longest > 1 && runs >= kNeverAnswered && evidence.failed == longest * runs;
}

const char* TakeThemOut(const bus::DeviceRecord& record) {
  return record.device->traits->has_modes ? ". Set the device to the mode for this request "
                                            "(remote), or take these points out of the profile"
                                          : ". Take these points out of the profile";
}

std::string NotAnswered(const Evidence& evidence) {
  return evidence.Last(Symptom::silence).ended ? "ends the connection at the request for "
                                               : "does not answer the request for ";
}

/// True if polls that are answered fail now and then too, so the trouble does not concern certain
/// polls only.
bool IsShaky(const bus::DeviceStatus& status) {
  return std::ranges::any_of(status.queries, [](const bus::QueryCount& query) {
    return query.in_vain < kNeverAnswered && std::popcount(query.failures) > 1;
  });
}

/// Reports points whose requests are never answered while other requests are.
Sentences SilentPoints(const bus::DeviceRecord& record, const Evidence& evidence) {
  if (record.status.unasked) return {};
  const bool silent = evidence.Count(Symptom::silence) == evidence.seen;
  // The device is not silent if a request got a refusal or an answer that does not fit.
  const auto was = [&](Symptom symptom) {
    return record.status.findings.Last(symptom).symptom == symptom;
  };
  const bool answered = !was(Symptom::silence) || was(Symptom::odd) || was(Symptom::other_reply) ||
                        was(Symptom::other_form);
  if (!silent || answered || !evidence.Last(Symptom::refusal).cause.empty() ||
      IsAbsent(record.status))
    return {};
  const bool tried = (evidence.looked == bus::Findings::kKept || FailsWithRepeats(evidence)) &&
                     !IsShaky(record.status);
  const std::string points = PointsOf(record, [&](std::size_t point) {
    const Quality& said = record.points[point].reported;
    const config::Point& its = record.device->points[point];
    const bool polled = its.group >= config::Group::fast && its.access != config::Access::write;
    return said.reason == Reason::not_fitted || (tried && polled && said == Quality::bad_waiting);
  });
  if (points.empty()) return {};
  return {NotAnswered(evidence) + points + ", but answers other requests" + TakeThemOut(record)};
}

/// True if the device answers requests other than the failing polls: other polls; or, if none of
/// the polled points has ever had a value, other requests, such as the request for its name.
bool HasOthers(const bus::DeviceRecord& record, const Evidence& evidence) {
  const std::vector<bus::QueryCount>& queries = record.status.queries;
  const auto is_good = [](const bus::QueryCount& query) {
    return query.points > 0 && query.in_vain == 0;
  };
  if (std::ranges::any_of(queries, is_good)) return true;
  const auto has_value = [&](std::size_t point) {
    return point < record.points.size() && HasValue(record.points[point].value);
  };
  const bool never = std::ranges::none_of(queries, [&](const bus::QueryCount& query) {
    return query.points > 0 && has_value(query.first_point);
  });
  return never && record.status.findings.Runs() > 1 && evidence.looked > evidence.failed;
}

/// Reports polls that have failed several times in a row while other requests are answered.
Sentences DeadQueries(const bus::DeviceRecord& record, const Evidence& evidence) {
  const bus::DeviceStatus& status = record.status;
  const auto fails = [](const bus::QueryCount& query) { return query.in_vain >= kNeverAnswered; };
  const bool others = HasOthers(record, evidence);
  if (!others || IsShaky(status) || status.findings.Count(Symptom::late) > 0) return {};
  const std::string points = NamesOf(record, fails, true);
  if (points.empty()) return {};
  const bool silent = std::ranges::all_of(status.queries, [&](const bus::QueryCount& query) {
    return !fails(query) || query.symptom == Symptom::silence;
  });
  if (silent) {
    const auto first = std::ranges::find_if(status.queries, fails);
    const std::string& place = record.device->points[first->first_point].read;
    return {NotAnswered(evidence) + points + " (" + place + ")" + ", but answers other requests" +
            TakeThemOut(record)};
  }
  const bool damaged = std::ranges::all_of(status.queries, [&](const bus::QueryCount& query) {
    return !fails(query) || IsDamage(query.symptom);
  });
  const auto judged = Judge(evidence);
  const bool pieces = damaged && evidence.Count(Symptom::split) > 0;
  if (!judged.empty() && (judged.front()->whole || pieces)) return Said("", evidence);
  const bool broken = std::ranges::all_of(status.queries, [&](const bus::QueryCount& query) {
    return !fails(query) || query.symptom == Symptom::tail_lost;
  });
  if (damaged && status.findings.specials().Suspects() == 0 && (!broken || judged.empty())) {
    return {"only the replies for " + points +
            " come damaged. Take these points out of the profile, or set the converter in between "
            "to raw"};
  }
  // If replies came one request late, all requests would be affected, not only these.
  const bool shifted = evidence.Count(Symptom::one_behind) > 0;
  const std::string before = "only the request for " + points + " fails: ";
  if (!shifted && !judged.empty()) return Said(before, evidence);
  return {before + "its reply does not fit the request (" + Shortened(status.last_reason) +
          "). Check that the profile fits the device"};
}

/// Returns text such as "3 of 32 exchanges failed: ". Empty: failures are too rare to report. If
/// the latest 32 exchanges contain too few failures, the runs of the last minutes are counted.
std::string HowOften(const bus::DeviceRecord& record, const Evidence& evidence) {
  if (evidence.failed >= kNotableFailures) {
    return fmt::format("{} of {} exchanges failed: ", evidence.failed, evidence.looked);
  }
  const FailureTally tally = TallyOf(record.status.spoilt);
  const double all = tally.failed + tally.answered;
  const bool often = tally.runs >= kManyRuns && Share(tally.failed, all) >= kNotableLosses;
  if (!often || evidence.seen == 0 || record.status.unasked) return {};
  return fmt::format("{:.0f} of {:.0f} exchanges failed: ", tally.failed, all);
}

bool HasWorked(const bus::DeviceRecord& record) {
  return record.status.Count(Outcome::ok) >= kAlways &&
         std::ranges::any_of(record.points,
                             [](const bus::PointRecord& point) { return HasValue(point.value); });
}

std::string Refusals(const bus::DeviceRecord& record, const Evidence& evidence) {
  const std::size_t count = evidence.Count(Symptom::refusal);
  if (count < kNotableFailures || LacksOptions(record)) return {};
  const Finding& last = evidence.Last(Symptom::refusal);
  const std::string reason =
      last.cause.empty() ? InWords(Name(record.status.last_outcome)) : Brief(last);
  const std::string points =
      NamesOf(record, [](const bus::QueryCount& query) { return query.refused >= kNeverAnswered; });
  const auto is_refused = [](const bus::PointRecord& point) {
    return point.reported.reason == Reason::not_fitted;
  };
  const bool none = !record.points.empty() && std::ranges::all_of(record.points, is_refused);
  // All polls must be refused, but not all exchanges: requests that are not polls may be answered.
  const auto& queries = record.status.queries;
  const bool all =
      !queries.empty() && std::ranges::all_of(queries, [](const bus::QueryCount& query) {
        return query.points == 0 || query.refused >= kNeverAnswered;
      });
  const bool always = none || all || (count == evidence.looked && count >= kAlways);
  const bool mostly = evidence.looked == bus::Findings::kKept && 2 * count >= evidence.looked;
  std::string remedy = RemedyOf(last);
  if (last.outcome == Outcome::busy && last.remedy.empty() && (always || mostly)) {
    remedy = always ? "end its programming, local or test mode, or restart it"
                    : "end its programming, local or test mode, or poll it less often (poll)";
  } else if (DoubtsProfile(remedy) &&
             ((always && HasWorked(record)) || RefusesWhatItGave(record))) {
    remedy = kHasWorked;
  }
  if (record.status.unasked) {
    const bool seldom = 2 * count < evidence.looked;
    return fmt::format(
        "{} ({} of its last {} messages){}{}", reason, count, evidence.looked, NextSentence(remedy),
        seldom
            ? "; or switch off other output between its messages (a printed header, another device)"
            : "");
  }
  return fmt::format("it answers '{}' to {} of {} requests{}{}", reason, count, evidence.looked,
                     points.empty() || always ? "" : " (" + points + ")", NextSentence(remedy));
}

}  // namespace

Sentences Said(const std::string& before, const Evidence& evidence) {
  const auto judged = Judge(evidence);
  if (judged.empty()) {
    const std::string looks = Looks(evidence);
    return {before + "no cause stands out" + (looks.empty() ? "" : " (" + looks + ")") +
            ". Run 'baudgate trace " + evidence.line->name + "' to see the bytes"};
  }
  Sentences said = Besides(evidence, judged);
  said.insert(said.begin(), before + judged.front()->say(evidence));
  return said;
}

bool FailsByEchoes(const Evidence& evidence) {
  using enum Symptom;
  if (!Echoes(*evidence.status) || !HasAnsweredLately(evidence.device->status, evidence.now))
    return false;
  return evidence.Share({echo, odd, one_behind, other_reply, two_replies, other_master}) > 0.9;
}

bool EndsAtRequests(const bus::DeviceRecord& record, const Evidence& evidence) {
  if (!evidence.Last(Symptom::silence).ended) return false;
  return HasDeadQuery(record, kNeverAnswered) || !SilentPoints(record, evidence).empty();
}

Sentences Failures(const bus::DeviceRecord& record, const Evidence& evidence) {
  Sentences found = evidence.eaten != 0 && HasDeadQuery(record, kNeverAnswered)
                        ? Said("", evidence)
                        : SilentPoints(record, evidence);
  if (found.empty()) found = DeadQueries(record, evidence);
  const std::string often = HowOften(record, evidence);
  if (!often.empty() && found.empty()) {
    found = Said(often, evidence);
  }
  const std::vector<bus::QueryCount>& queries = record.status.queries;
  const bool none =
      !queries.empty() && std::ranges::all_of(queries, [](const bus::QueryCount& query) {
        return query.points == 0 || query.in_vain > 0;
      });
  // Probes may be answered and outnumber the polls, so that failures look rare.
  if (found.empty() && none && evidence.failed > 0) {
    found = Said("it answers, but its polls fail: ", evidence);
  }
  if (std::string refusals = Refusals(record, evidence); !refusals.empty()) {
    const bool away = !found.empty() && FindAbsences(record.status.failures).has_value();
    const bool more = evidence.Count(Symptom::refusal) > evidence.failed && !away;
    found.insert(more ? found.begin() : found.end(), std::move(refusals));
  }
  return found;
}

}  // namespace baudgate::diagnosis
