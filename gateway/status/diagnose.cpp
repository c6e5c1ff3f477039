// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/diagnose.h"

#include <fmt/format.h>

#include <algorithm>

#include "gateway/base/shown.h"
#include "gateway/status/diagnose_points.h"
#include "gateway/status/evidence.h"
#include "gateway/status/hypotheses.h"
#include "gateway/status/line_time.h"
#include "gateway/status/words.h"

namespace baudgate::control {
namespace {

using Sentences = std::vector<std::string>;

/// A single failure of a device that answers is not worth a sentence.
constexpr std::size_t kNotableFailures = 2;
/// So many in a row are no outage of the port.
constexpr std::size_t kManyFailures = 8;
/// Bytes beside good replies, of the exchanges that are kept.
constexpr std::size_t kNotableNoise = 3;
/// Bytes around a reply that were the same so often are no noise.
constexpr std::size_t kConstant = 4;
/// A request that has failed so often in a row, beside others that are answered.
constexpr std::uint32_t kNeverAnswered = 3;
/// An outage of the last hour that was shorter than that part is not worth a word.
constexpr double kNotableOutage = 0.01;
/// One that begins so soon behind the start may be its end.
constexpr Duration kStart = 5min;
/// A device that speaks unasked may be silent so long without a word about it.
constexpr Duration kNotableSilence = 1min;

std::string Noticed(const LineStatus& line, const DeviceStatus& status) {
  if (status.unasked) return "its next message is waited for";
  if (line.notice_bound <= Duration::zero()) return "it is asked again and again";
  return "its return is noticed within " + FormatAge(line.notice_bound);
}

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

/// "cause: remedy" behind `before`, and in sentences of their own what goes with it.
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

/// "3 outages in the last hour": what a look at the present does not show. Empty: none, or one that
/// is not worth a word.
std::string Outages(const DeviceRecord& record, std::uint32_t from, Now now, Instant started) {
  const MinuteCounts hour = record.status.hour.Sum(now.instant);
  if (now.instant - started < kStart) from = std::max<std::uint32_t>(from, 2);
  if (hour.outages < from || 1 - Availability(hour) < kNotableOutage) return {};
  const Duration since = std::min<Duration>(now.instant - started, 1h);
  return fmt::format("{} in the last {}", Plural(hour.outages, "outage"),
                     since < 1h ? FormatAge(since) : "hour");
}

std::string AnsweredShare(const DeviceRecord& record, Now now) {
  return fmt::format("answered {} of the time",
                     Percent(Availability(record.status.hour.Sum(now.instant))));
}

Sentences Absence(const LineStatus& line, const DeviceRecord& record,
                  std::span<const DeviceRecord> all, Now now, Instant started) {
  const DeviceStatus& status = record.status;
  std::string since = status.last_ok ? "offline for " + FormatAge(now.instant - *status.last_ok)
                                     : "has never answered";
  const Evidence evidence = Gather(line, record, all, now);
  if (status.last_ok && evidence.failed == 0) return {};  // it is on its way back
  if (AbsentTogether(all)) {
    return {since + ", as no device of line '" + record.line->name + "' answers"};
  }
  const std::string often = status.last_ok ? Outages(record, 2, now, started) : std::string();
  if (!often.empty()) since += " (" + often + ")";
  Sentences said = Said(since + ": ", evidence);
  if (!often.empty()) said.push_back(AnsweredShare(record, now));
  const bool silent = evidence.Count(Symptom::silence) == evidence.failed;
  if (silent && status.last_ok) said.push_back(Noticed(line, status));
  return said;
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
  if (!others || status.findings.Count(Symptom::late) > 0) return {};
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
            " come damaged always, and no others: take these points out of the profile, or set the "
            "converter in between to raw"};
  }
  const bool shifted = evidence.Count(Symptom::one_behind) > 0;  // and that would shift all
  const std::string before = "the request for " + points + " fails always, and no other: ";
  if (!shifted && !judged.empty()) return Said(before, evidence);
  return {before + "its reply does not fit (" + status.last_reason +
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

/// What fails, and what it refuses: what there is more of comes first.
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

/// The same bytes around its replies, which something in between puts there.
std::string Wrapped(const DeviceRecord& record) {
  const Findings& findings = record.status.findings;
  const std::size_t beside = findings.Count(Symptom::few_beside) +
                             findings.Count(Symptom::noise_before) +
                             findings.Count(Symptom::noise_behind);
  if (beside < kNotableNoise || findings.SameAround() < kConstant) return {};
  // 00 and FF are of a line that nobody drives.
  if (findings.Around().find_first_not_of("0F .") == std::string::npos) return {};
  if (2 * beside < findings.size() || findings.Around().empty()) return {};
  return fmt::format(
      "the same bytes stand around its replies ({}) in {} of {} exchanges: set the modem, radio or "
      "serial server in between to raw (no packet frame), or terminate the bus",
      findings.Around(), beside, findings.size());
}

/// What comes beside good replies, where it is not the line's (gateway/status/diagnose_line.cpp).
Sentences Beside(const DeviceRecord& record) {
  const Findings& findings = record.status.findings;
  Sentences found;
  const auto say = [&](std::size_t count, const char* what, const char* remedy) {
    if (count < kNotableNoise) return;
    found.push_back(
        fmt::format("{} in {} of {} exchanges: {}", what, count, findings.size(), remedy));
  };
  // Of two devices with one address some replies are alike.
  const std::size_t others = findings.Count(Symptom::others_beside);
  const std::size_t copies = findings.Count(Symptom::copies);
  say(others, "a second reply with another content follows",
      "two devices have its address (unplug one), or another master asks it");
  if (copies >= kNotableNoise && record.status.doubled >= kNotableNoise) {
    say(copies, "its replies come twice, and differ",
        "two devices have its address (unplug one), or a serial server, radio or repeater repeats");
  } else if (others < kNotableNoise) {
    say(copies + others, "its replies come twice",
        "a serial server, radio or repeater in between sends twice; values are right");
  }
  if (std::string wrapped = Wrapped(record); !wrapped.empty()) {
    found.push_back(std::move(wrapped));
    return found;
  }
  const bool server = !SerialOf(record).on_wire();
  const char* const noise =
      server
          ? "the server sends what nobody asked for; let one client use it, or update its firmware"
          : "noise while nobody drives the bus; check bias resistors, termination and ground";
  const std::size_t before = findings.Count(Symptom::noise_before);
  const std::size_t behind = findings.Count(Symptom::noise_behind);
  const char* const where = before == 0   ? "stray bytes follow its replies"
                            : behind == 0 ? "stray bytes stand before its replies"
                                          : "stray bytes stand before and behind its replies";
  say(before + behind, where, noise);
  return found;
}

/// It is waited for longer than configured, and so answers in time.
Sentences Patience(const DeviceStatus& status) {
  if (status.patience <= Duration()) return {};
  const Duration reply = status.timing.reply.value_or(Duration{});
  const Duration seen = status.findings.Count(Symptom::late) > 0
                            ? std::max(reply, status.findings.Last(Symptom::late).time)
                            : reply + status.patience;
  return {
      fmt::format("late: its replies come up to {} ms after the request, and timing.reply is {} "
                  "ms: set timing: "
                  "{{ reply: {}ms }} at the device",
                  Milliseconds(seen), Milliseconds(reply), 50 * (Milliseconds(seen) / 50 + 2))};
}

/// Of a device that speaks when it likes: nothing that it says can be read, or much cannot.
Sentences Unreadable(const DeviceRecord& record, const Evidence& evidence) {
  if (!record.status.unasked || evidence.failed < kNotableFailures) return {};
  if (!record.status.last_ok) return Said("no message of it was good yet: ", evidence);
  return Said(fmt::format("{} of its last {} messages are bad: ", evidence.failed, evidence.looked),
              evidence);
}

/// Of a device that speaks when it likes.
Sentences Silence(const DeviceRecord& record, Now now) {
  const DeviceStatus& status = record.status;
  const auto& max_age = record.device->max_age;
  if (!status.last_ok && max_age) {
    return {"has not spoken yet, and its max_age is " + FormatDuration(*max_age) +
            ": check its power and wire, then bit rate and parity (" +
            record.line->serial.ToString() + ") and its options"};
  }
  if (!status.last_ok) {
    return {
        "has not spoken yet: normal where nothing has happened; if something has, check power, "
        "bit rate, parity and wiring (" +
        record.line->serial.ToString() + ") and its options"};
  }
  Sentences found;
  if (const Duration silent = now.instant - *status.last_ok;
      silent >= kNotableSilence && !max_age) {
    found.push_back("silent for " + FormatAge(silent) +
                    ": normal, it speaks only when it has something to say");
  }
  if (status.lost_events > 0) {
    found.push_back(Plural(status.lost_events, "event") +
                    " lost: it went on while the disk failed; see the events in 'baudgate status'");
  }
  return found;
}

/// Before its port was opened anew as well.
bool FailsAlways(const DeviceStatus& status) {
  const Findings& findings = status.findings;
  const std::size_t run = findings.LongestRun();
  return (findings.size() >= kNotableFailures && run == findings.size()) ||
         (IsAbsent(status) && run >= kManyFailures);
}

}  // namespace

std::string ClockText(WallTime time) { return FormatWallTime(time).substr(11, 8) + " UTC"; }

Sentences DiagnoseDevice(const LineStatus& line, const DeviceRecord& device,
                         std::span<const DeviceRecord> all, Now now, Instant started) {
  const DeviceStatus& status = device.status;
  if (status.state == DeviceState::disabled) {
    if (!device.device->enabled) return {"disabled in the configuration (enabled: false)"};
    return {"taken out of use at run time; 'baudgate enable " + NameOf(device) +
            "' brings it back"};
  }
  if (line.port != LineStatus::Port::open) return {};
  if (status.unasked && status.exchanges == 0) return Silence(device, now);
  const Evidence evidence = Gather(line, device, all, now);
  if (Sentences unreadable = Unreadable(device, evidence); !unreadable.empty()) return unreadable;
  if (status.exchanges == 0 && status.findings.size() == 0) return {"not asked yet"};
  // A server that ends the connection may have said what it is.
  const bool told = status.findings.Count(Symptom::other_protocol) > 0 ||
                    status.findings.Count(Symptom::text) > 0;
  if (status.last_outcome == Outcome::line_down && !told && !FailsAlways(status)) {
    return {status.unasked ? "has not spoken since the port was opened: normal where nothing has "
                             "happened"
                           : "not asked since the port was opened"};
  }
  if (line.cut_since && IsAbsent(status)) {
    return {"cannot be reached: the ring of line '" + device.line->name +
            "' is open; this says nothing about the device"};
  }
  if (IsAbsent(status)) {
    return Absence(line, device, all, now, started);
  }

  Sentences found;
  const auto add = [&found](Sentences more) {
    for (std::string& sentence : more) found.push_back(std::move(sentence));
  };
  if (IsForeign(device)) {
    found.push_back("no value is good: " + status.trouble);
  } else {
    add(Failures(device, evidence));
  }
  const Sentences beside = Beside(device);
  // What stands beside many replies explains the few that fail.
  const bool explains = !beside.empty() && evidence.looked > 3 * evidence.failed;
  const bool two = evidence.Count(Symptom::others_beside) >= kNotableNoise;
  if (two || (explains && evidence.Count(Symptom::silence) < evidence.failed)) {
    found.insert(found.begin(), beside.begin(), beside.end());
  } else {
    add(beside);
  }
  if (status.unasked) add(Silence(device, now));
  if (found.empty()) add(Patience(status));
  if (status.doubled > 0 && status.findings.Count(Symptom::others_beside) == 0) {
    found.push_back(fmt::format(
        "doubled: a second, different reply came behind one {}: replies come twice, or one request "
        "late; values may have been another's for a moment. Look at the serial server, radio or "
        "repeater in between",
        Times(status.doubled)));
  }
  const double missed = MissedShare(device, now, started);
  const std::string why = missed > 0 ? WhyNoTime(line, all, &device, now, started) : std::string();
  if (!why.empty()) {
    found.push_back(
        fmt::format("missed {} of its polls in the last minutes: {}", Percent(missed), why));
  }
  add(DiagnosePoints(line, device, now));
  if (found.empty()) add(DiagnoseWaiting(device, now, started));
  const std::string outages = Outages(device, 1, now, started);
  if (found.empty() && !outages.empty()) {
    found.push_back(outages + ", and it " + AnsweredShare(device, now) +
                    ": look at its power and its wire");
  }
  if (!IsForeign(device) && !status.trouble.empty()) found.push_back(status.trouble);
  if (found.empty() && status.state == DeviceState::degraded) {
    found.push_back("degraded: several of its last 32 exchanges failed" +
                    (status.last_reason.empty() ? "" : "; last: " + status.last_reason));
  }
  return found;
}

}  // namespace baudgate::control
