// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/causes/diagnose.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "gateway/base/shown.h"
#include "gateway/diagnosis/causes/words.h"

namespace baudgate::diagnosis {
namespace {

using Sentences = std::vector<std::string>;

/// Readings whose jump a second reading did not confirm are reported if there are kUnconfirmed of
/// them, and at least one in kUnconfirmedShare exchanges.
constexpr std::uint32_t kUnconfirmed = 4;
constexpr std::uint32_t kUnconfirmedShare = 25;
/// From this number of failures in a row on, they come from the device, not from a short loss of
/// the port.
constexpr std::size_t kManyFailures = 8;
/// Outages are reported from this share of the last hour on.
constexpr double kNotableOutage = 0.01;
/// If replies came one or more requests late in this many exchanges in a row, this is no short
/// disturbance.
constexpr std::uint32_t kManyBehind = 16;
/// Within this time after the start of the program a single outage is not reported, because it may
/// have begun before the start.
constexpr Duration kStart = 5min;

std::string Noticed(const bus::LineStatus& line, const bus::DeviceStatus& status) {
  if (status.unasked) return "the gateway waits for its next message";
  if (!line.notice_bound) return "the gateway polls it again and again";
  return "the gateway notices its return within " + FormatAge(*line.notice_bound);
}

/// Returns text such as "3 outages in the last hour". Empty: there were fewer than `from` outages,
/// or they were short.
std::string Outages(const bus::DeviceRecord& record, std::uint32_t from, Now now, Instant started) {
  const bus::MinuteCounts hour = record.status.hour.Sum(now.instant);
  if (now.instant - started < kStart) from = std::max<std::uint32_t>(from, 2);
  if (hour.outages < from || 1 - Availability(hour) < kNotableOutage) return {};
  const Duration since = std::min<Duration>(now.instant - started, 1h);
  return fmt::format("{} in the last {}", Plural(hour.outages, "outage"),
                     since < 1h ? FormatAge(since) : "hour");
}

std::string AnsweredShare(const bus::DeviceRecord& record, Now now) {
  return fmt::format("answered {} of the time",
                     Percent(Availability(record.status.hour.Sum(now.instant))));
}

Sentences Absence(const bus::LineStatus& line, const bus::DeviceRecord& record,
                  std::span<const bus::DeviceRecord> all, Now now, Instant started) {
  const bus::DeviceStatus& status = record.status;
  std::string since = status.last_ok ? "offline for " + FormatAge(now.instant - *status.last_ok)
                                     : "has never answered";
  const Evidence evidence = Gather(line, record, all, now);
  if (status.last_ok && evidence.failed == 0) return {};
  if (AbsentTogether(all)) {
    return {since + ", as no device of line '" + record.line->name + "' answers"};
  }
  const std::string often = status.last_ok ? Outages(record, 2, now, started) : std::string();
  const bool silent = evidence.Count(Symptom::silence) == evidence.seen;
  if (!often.empty() && silent) since += " (" + often + ")";
  Sentences said = Said(since + ": ", evidence);
  if (!often.empty()) {
    said.push_back((silent ? "" : often + ", and it ") + AnsweredShare(record, now));
  }
  if (silent && status.last_ok) said.push_back(Noticed(line, status));
  return said;
}

/// Reports a device whose replies come late, but are received because the line waits longer than
/// configured. A single late reply is not reported.
Sentences Patience(const bus::DeviceStatus& status) {
  if (status.patience <= Duration() || status.late < 2) return {};
  const Duration reply = status.timing.reply.value_or(Duration{});
  const Duration seen = status.findings.Count(Symptom::late) > 0
                            ? std::max(reply, status.findings.Last(Symptom::late).time)
                            : reply + std::min(status.patience, status.lateness);
  return {
      fmt::format("late: its replies come up to {} ms after the request (timing.reply: {} ms). "
                  "Set timing: {{ reply: {}ms }} in the configuration",
                  Milliseconds(seen), Milliseconds(reply), 50 * (Milliseconds(seen) / 50 + 2))};
}

/// True if no other device that answers has stray bytes beside its replies in more than one
/// exchange, and at least one of these devices has all its kKept exchanges stored.
bool IsCleanElsewhere(const bus::DeviceRecord& device, std::span<const bus::DeviceRecord> all) {
  bool asked = false;
  for (const bus::DeviceRecord& one : all) {
    if (one.device == device.device || !Answers(one.status.state)) continue;
    const bus::Findings& findings = one.status.findings;
    if (findings.Count(Symptom::noise_before) + findings.Count(Symptom::noise_behind) > 1)
      return false;
    asked = asked || findings.size() == bus::Findings::kKept;
  }
  return asked;
}

/// True if replies of another device come in parts: a part that comes late may come beside a reply
/// of this device.
bool ComesLateElsewhere(const bus::DeviceRecord& device, std::span<const bus::DeviceRecord> all) {
  return std::ranges::any_of(all, [&](const bus::DeviceRecord& one) {
    return one.device != device.device &&
           one.status.findings.Count(Symptom::split) >= kNotableFailures;
  });
}

/// True if all stored exchanges of the device failed, or it is offline and many in a row failed.
/// The failures then did not begin with the loss of the port.
bool FailsAlways(const bus::DeviceStatus& status) {
  const bus::Findings& findings = status.findings;
  const std::size_t run = findings.LongestRun();
  return (findings.size() >= kNotableFailures && run == findings.size()) ||
         (IsAbsent(status) && run >= kManyFailures);
}

/// Returns a sentence if the device cannot be judged, for example because it was not asked yet.
/// Nothing: it can be judged.
std::optional<Sentences> NotJudged(const bus::LineStatus& line, const bus::DeviceRecord& device,
                                   const Evidence& evidence, Now now) {
  const bus::DeviceStatus& status = device.status;
  if (status.unasked && status.exchanges == 0) return Silence(device, now);
  if (Sentences nothing = AnswersNothing(device, evidence); !nothing.empty()) return nothing;
  if (Sentences unreadable = Unreadable(device, evidence); !unreadable.empty()) return unreadable;
  if (status.exchanges == 0 && status.findings.size() == 0) return Sentences{"not asked yet"};
  // A server that closes the connection may first have sent a text that names its service.
  const bool told = status.findings.Count(Symptom::other_protocol) > 0 ||
                    status.findings.Count(Symptom::text) > 0;
  if (status.last_outcome == Outcome::line_down && !told && !FailsAlways(status)) {
    return Sentences{
        status.unasked
            ? "has sent nothing since the port was opened, which is normal if nothing has happened"
            : "not asked since the port was opened"};
  }
  if (line.cut_since && IsAbsent(status)) {
    return Sentences{"cannot be reached, because the ring of line '" + device.line->name +
                     "' is open. Close the ring first: the device itself may work"};
  }
  return std::nullopt;
}

/// Returns sentences about failed exchanges and about bytes beside replies. If the bytes are the
/// cause of the failures, the sentences about bytes come first.
Sentences Exchanges(const bus::DeviceRecord& device, const Evidence& evidence,
                    std::span<const bus::DeviceRecord> all) {
  Sentences found;
  if (IsForeign(device)) {
    const auto other = std::ranges::find_if(all, [&](const bus::DeviceRecord& one) {
      return one.device != device.device && IsForeign(one);
    });
    // Two devices with one address damage each other's replies.
    const bool two = evidence.Share({Symptom::two_replies, Symptom::damaged, Symptom::bad_check,
                                     Symptom::bytes_added}) > 0.5;
    found.push_back("no value is good: " + device.status.trouble +
                    (other != all.end() ? ". Check whether it and " + other->device->name +
                                              " have each other's address"
                     : two ? NextSentence(CheckAddress(*device.device))
                           : ""));
  } else if (!FailsByEchoes(evidence)) {
    found = Failures(device, evidence);
  }
  const bool late = ComesLateElsewhere(device, all);
  const Sentences beside = late ? Sentences() : Beside(device, IsCleanElsewhere(device, all));
  // If exchanges often have bytes beside the reply and few exchanges fail, the bytes are the cause.
  const bool explains = !beside.empty() && evidence.looked > 3 * evidence.failed &&
                        evidence.Count(Symptom::silence) < evidence.seen;
  const bool first = AreTwo(device.status.findings) || explains;
  found.insert(first ? found.begin() : found.end(), beside.begin(), beside.end());
  return found;
}

/// Reports readings that changed when they were read again. Empty: such readings are rare, or most
/// jumps were confirmed.
Sentences Unconfirmed(const bus::DeviceStatus& status) {
  if (status.unconfirmed < kUnconfirmed || 3 * status.unconfirmed < status.rechecks) return {};
  if (kUnconfirmedShare * status.unconfirmed < status.exchanges) return {};
  return {
      fmt::format("{} of its readings changed when they were read again, so replies may be damaged "
                  "although they look whole. Look for noise, and switch a checksum on at the "
                  "device and in the configuration",
                  status.unconfirmed)};
}

/// Reports a device whose replies answer earlier requests.
Sentences Behind(const bus::DeviceRecord& device, Now now) {
  const bus::DeviceStatus& status = device.status;
  if (status.behind < kManyBehind) return {};
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    if (!IsGood(QualityAt(device, i, now.instant))) continue;
    return {
        "its replies answer the previous request, so the gateway sends each request twice. Restart "
        "the serial server or radio in between, and switch its cache off"};
  }
  return {"its replies do not fit the requests (" + Shortened(status.last_reason) + ")" +
          NextSentence(RemedyOf({.remedy = status.findings.Last(Symptom::odd).remedy}))};
}

/// Reports second, different replies, if there was more than one and the last is less than an hour
/// ago. Reports nothing if another cause is known: another master, other replies beside good
/// replies, or echoes.
Sentences Doubled(const bus::DeviceRecord& device, const Evidence& evidence) {
  const bus::DeviceStatus& status = device.status;
  const bool again = status.doubled > 1 && evidence.now - status.last_doubled < 1h;
  const bool told = evidence.master != nullptr || evidence.Count(Symptom::others_beside) > 0;
  if (!again || told || FailsByEchoes(evidence)) return {};
  return {fmt::format(
      "a second, different reply to one request came {}. Check the serial server, radio or "
      "repeater in between: it sends replies twice, or only after the next request",
      Times(status.doubled))};
}

}  // namespace

std::string ClockText(WallTime time) { return FormatWallTime(time).substr(11, 8) + " UTC"; }

Sentences DiagnoseDevice(const bus::LineStatus& line, const bus::DeviceRecord& device,
                         std::span<const bus::DeviceRecord> all, Now now, Instant started) {
  const bus::DeviceStatus& status = device.status;
  if (status.state == bus::DeviceState::disabled) {
    if (!device.device->enabled) return {"disabled in the configuration (enabled: false)"};
    return {"disabled at run time. Run 'baudgate enable " + NameOf(device) + "' to use it again"};
  }
  if (line.port != bus::LineStatus::Port::open) return {};
  const Evidence evidence = Gather(line, device, all, now);
  if (auto only = NotJudged(line, device, evidence, now)) return *std::move(only);
  // A sentence of the line reports the echo, so none is made here.
  const bool echoes = FailsByEchoes(evidence);
  if (IsAbsent(status)) {
    return echoes ? Sentences() : Absence(line, device, all, now, started);
  }

  Sentences found = Exchanges(device, evidence, all);
  const auto add = [&found](Sentences more) {
    for (std::string& sentence : more) found.push_back(std::move(sentence));
  };
  if (status.unasked) add(Silence(device, now));
  if (found.empty()) add(Patience(status));
  if (found.empty()) add(Unconfirmed(status));
  if (found.empty()) add(Behind(device, now));
  add(Doubled(device, evidence));
  if (status.lacks_time) {
    found.push_back(
        "its clock is not set, because the clock of this machine may be wrong. Set up NTP (chrony) "
        "on this machine");
  }
  const double missed = MissedShare(device, now, started);
  const std::string why = missed > 0 ? WhyNoTime(line, all, &device, now, started) : std::string();
  if (!why.empty()) {
    found.push_back(
        fmt::format("missed {} of its polls in the last minutes: {}", Percent(missed), why));
  }
  if (!echoes) add(DiagnosePoints(line, device, now));
  if (found.empty() && !echoes) add(DiagnoseWaiting(device, now, started));
  const std::string outages = Outages(device, 1, now, started);
  if (found.empty() && !outages.empty() && !Echoes(line)) {
    found.push_back(outages + ", and it " + AnsweredShare(device, now) +
                    ". Check its power and its wire");
  }
  if (!IsForeign(device) && !status.trouble.empty()) found.push_back(status.trouble);
  if (found.empty() && status.state == bus::DeviceState::degraded && !Echoes(line)) {
    found.push_back("degraded: several of its last 32 exchanges failed" +
                    (status.last_reason.empty() ? "" : "; last failure: " + status.last_reason));
  }
  if (!echoes) add(NoteAbsent(line, device, now));
  return found;
}

}  // namespace baudgate::diagnosis
