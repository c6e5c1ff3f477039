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

/// Unconfirmed readings are reported from this number and this share (1/25) of exchanges on.
constexpr std::uint32_t kUnconfirmed = 4;
constexpr std::uint32_t kUnconfirmedShare = 25;
/// More failures in a row than an outage of the port causes.
constexpr std::size_t kManyFailures = 8;
/// A device that was unavailable for a smaller share of the last hour is not reported.
constexpr double kNotableOutage = 0.01;
/// More late replies in a row than a short disturbance causes.
constexpr std::uint32_t kManyBehind = 16;
/// A single outage is not reported this soon after the start, because it may have begun before.
constexpr Duration kStart = 5min;

std::string Noticed(const bus::LineStatus& line, const bus::DeviceStatus& status) {
  if (status.unasked) return "the gateway waits for its next message";
  if (!line.notice_bound) return "the gateway polls it again and again";
  return "the gateway notices its return within " + FormatAge(*line.notice_bound);
}

/// "3 outages in the last hour". Empty: fewer than `from` outages, or they were short.
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
  if (status.last_ok && evidence.failed == 0) return {};  // the device answers again
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

/// Reports a device whose replies are late but are still received, because the gateway waits longer
/// than configured. A single late reply is ignored.
Sentences Patience(const bus::DeviceStatus& status) {
  if (status.patience <= Duration() || status.late < 2) return {};
  const Duration reply = status.timing.reply.value_or(Duration{});
  const Duration seen = status.findings.Count(Symptom::late) > 0
                            ? std::max(reply, status.findings.Last(Symptom::late).time)
                            : reply + std::min(status.patience, status.lateness);
  return {
      fmt::format("late: its replies come up to {} ms after the request, and timing.reply is {} "
                  "ms. Set timing: {{ reply: {}ms }} in the configuration",
                  Milliseconds(seen), Milliseconds(reply), 50 * (Milliseconds(seen) / 50 + 2))};
}

/// True if a neighbour is asked as often and no neighbour has stray bytes beside its replies.
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

/// Late parts of a neighbour's replies may come beside the replies of this device.
bool ComesLateElsewhere(const bus::DeviceRecord& device, std::span<const bus::DeviceRecord> all) {
  return std::ranges::any_of(all, [&](const bus::DeviceRecord& one) {
    return one.device != device.device &&
           one.status.findings.Count(Symptom::split) >= kNotableFailures;
  });
}

/// True if the device has always failed, including before the port was reopened.
bool FailsAlways(const bus::DeviceStatus& status) {
  const bus::Findings& findings = status.findings;
  const std::size_t run = findings.LongestRun();
  return (findings.size() >= kNotableFailures && run == findings.size()) ||
         (IsAbsent(status) && run >= kManyFailures);
}

/// Why the device is not judged, for example because it was not asked yet. Nothing: it is judged.
std::optional<Sentences> NotJudged(const bus::LineStatus& line, const bus::DeviceRecord& device,
                                   const Evidence& evidence, Now now) {
  const bus::DeviceStatus& status = device.status;
  if (status.unasked && status.exchanges == 0) return Silence(device, now);
  if (Sentences nothing = AnswersNothing(device, evidence); !nothing.empty()) return nothing;
  if (Sentences unreadable = Unreadable(device, evidence); !unreadable.empty()) return unreadable;
  if (status.exchanges == 0 && status.findings.size() == 0) return Sentences{"not asked yet"};
  // A server that ends the connection may have sent a text that names its service.
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
                     "' is open. Close the ring first: the device itself may be well"};
  }
  return std::nullopt;
}

/// Sentences about failed exchanges and about bytes beside replies; the cause comes first.
Sentences Exchanges(const bus::DeviceRecord& device, const Evidence& evidence,
                    std::span<const bus::DeviceRecord> all) {
  Sentences found;
  if (IsForeign(device)) {
    const auto other = std::ranges::find_if(all, [&](const bus::DeviceRecord& one) {
      return one.device != device.device && IsForeign(one);
    });
    // If two devices with one address answer, they damage each other's replies.
    const bool two = evidence.Share({Symptom::two_replies, Symptom::damaged, Symptom::bad_check,
                                     Symptom::bytes_added}) > 0.5;
    found.push_back("no value is good: " + device.status.trouble +
                    (other != all.end()
                         ? ". Check whether it and " + other->device->name + " are swapped"
                     : two ? NextSentence(CheckAddress(*device.device))
                           : ""));
  } else if (!FailsByEchoes(evidence)) {
    found = Failures(device, evidence);
  }
  const bool late = ComesLateElsewhere(device, all);
  const Sentences beside = late ? Sentences() : Beside(device, IsCleanElsewhere(device, all));
  // If such bytes are frequent and failures are few, the bytes are the cause.
  const bool explains = !beside.empty() && evidence.looked > 3 * evidence.failed &&
                        evidence.Count(Symptom::silence) < evidence.seen;
  const bool first = AreTwo(device.status.findings) || explains;
  found.insert(first ? found.begin() : found.end(), beside.begin(), beside.end());
  return found;
}

/// Readings that changed when they were read again. Empty: rare, or most jumps were confirmed.
Sentences Unconfirmed(const bus::DeviceStatus& status) {
  if (status.unconfirmed < kUnconfirmed || 3 * status.unconfirmed < status.rechecks) return {};
  if (kUnconfirmedShare * status.unconfirmed < status.exchanges) return {};
  return {fmt::format(
      "{} of its readings changed when they were read again. Replies come damaged without a check "
      "value: switch a checksum on at the device and here, and look for noise",
      status.unconfirmed)};
}

/// Reports that the replies of the device belong to earlier requests.
Sentences Behind(const bus::DeviceRecord& device, Now now) {
  const bus::DeviceStatus& status = device.status;
  if (status.behind < kManyBehind) return {};
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    if (!IsGood(QualityAt(device, i, now.instant))) continue;
    return {
        "its replies answer the previous request, so the gateway sends each request twice. Restart "
        "the serial server or radio in between, and switch its cache off"};
  }
  return {"its replies do not fit (" + Shortened(status.last_reason) + ")" +
          NextSentence(RemedyOf({.remedy = status.findings.Last(Symptom::odd).remedy}))};
}

/// Reports second, different replies that come now and then.
Sentences Doubled(const bus::DeviceRecord& device, const Evidence& evidence) {
  const bus::DeviceStatus& status = device.status;
  const bool again = status.doubled > 1 && evidence.now - status.last_doubled < 1h;
  const bool told = evidence.master != nullptr || evidence.Count(Symptom::others_beside) > 0;
  if (!again || told || FailsByEchoes(evidence)) return {};
  return {
      fmt::format("a second, different reply to one request came {}. Check the serial server, "
                  "radio or repeater "
                  "in between: it sends replies twice, or one request late",
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
  // The sentence of the line reports the echo.
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
                    (status.last_reason.empty() ? "" : "; last: " + status.last_reason));
  }
  if (!echoes) add(NoteAbsent(line, device, now));
  return found;
}

}  // namespace baudgate::diagnosis
