// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/diagnose.h"

#include <fmt/format.h>

#include "gateway/base/shown.h"

namespace baudgate::control {
namespace {

using Sentences = std::vector<std::string>;

/// So much of a line's incoming bytes may be stray before it is said.
constexpr double kNotableStray = 0.05;
/// Devices may ask to wait now and then; so often is a poll period that is too short.
constexpr double kNotableBusy = 0.1;
/// A line is called full from here on.
constexpr double kFullLine = 0.9;
/// A device that speaks unasked may be silent so long without a word about it.
constexpr Duration kNotableSilence = 1min;

double Share(double part, double whole) { return whole > 0 ? part / whole : 0; }

std::string Percent(double share) {
  const double percent = 100 * share;
  return percent < 9.95 ? fmt::format("{:.1f} %", percent) : fmt::format("{:.0f} %", percent);
}

std::string Times(std::uint64_t count) {
  return count == 1 ? "once" : fmt::format("{} times", count);
}

std::string Milliseconds(Duration duration) {
  return fmt::format("{} ms", std::chrono::ceil<std::chrono::milliseconds>(duration).count());
}

config::SerialSettings SerialOf(const DeviceRecord& record) {
  return record.device->serial.value_or(record.line->serial);
}

/// What both ends must agree on.
std::string SettingsOf(const DeviceRecord& record) {
  const std::string address = "address " + record.device->address;
  const config::SerialSettings serial = SerialOf(record);
  return serial.on_wire() ? address + ", " + serial.ToString() : address;
}

/// Why frames that came are no frames.
std::string RemedyOfDamage(const DeviceRecord& record) {
  if (!SerialOf(record).on_wire()) {
    return "is there Modbus TCP at " + record.line->port +
           "? A serial server that passes Modbus RTU on needs protocol: modbus_rtu";
  }
  return "check parity, data bits and checksum (" + SettingsOf(record) +
         "), then noise, or a second device with its address";
}

std::string RemedyOfSilence(const DeviceRecord& record) {
  if (!SerialOf(record).on_wire()) {
    return "check its power, its address (" + record.device->address + ") and what is behind " +
           record.line->port;
  }
  return "check power, address, bit rate, parity and wiring (" + SettingsOf(record) + ")";
}

std::string NameOf(const DeviceRecord& record) {
  return record.line->name + "." + record.device->name;
}

std::string Noticed(const LineStatus& line, const DeviceStatus& status) {
  if (status.unasked) return "its next message is waited for";
  if (line.notice_bound <= Duration::zero()) return "it is asked again and again";
  return "its return is noticed within " + FormatAge(line.notice_bound);
}

std::string Late(const DeviceStatus& status) {
  if (status.late == 0) {
    return "late: its replies come after timing.reply is over, and it is waited for " +
           Milliseconds(status.patience) + " longer: raise its timing.reply by as much";
  }
  const std::string lateness = Milliseconds(status.lateness);
  const bool away = status.state == DeviceState::never_seen || status.state == DeviceState::offline;
  const std::string waited =
      status.patience > Duration() && !away
          ? "; until then it is waited for " + Milliseconds(status.patience) + " longer"
          : "";
  return fmt::format(
      "late: replies came up to {} after they were due, {}: raise its timing.reply by more than "
      "{}{}",
      lateness, Times(status.late), lateness, waited);
}

/// Bytes that come too late are why it seems silent, or answers to another request; a few of them
/// long ago are not.
bool IsLate(const DeviceStatus& status) {
  const std::uint32_t failed = status.Count(Outcome::no_reply) + status.Count(Outcome::unexpected);
  return status.late > 0 && 4 * std::uint64_t{status.late} >= failed;
}

/// What to look at when a device is not there, by how its exchanges end.
std::string RemedyOfAbsence(const DeviceRecord& record) {
  const DeviceStatus& status = record.status;
  switch (status.last_outcome) {
    case Outcome::corrupt:
      return "its answers cannot be read: " + RemedyOfDamage(record);
    case Outcome::partial:
      return "its answers stop half-way: raise its timing.gap, then check wiring";
    case Outcome::unexpected:
      if (IsLate(status)) return Late(status);
      return "something else answers: check its address (" + record.device->address +
             "), and for a second master on the bus";
    default:
      if (IsLate(status)) return Late(status);
      return RemedyOfSilence(record);
  }
}

std::string Absence(const LineStatus& line, const DeviceRecord& record, Now now) {
  const DeviceStatus& status = record.status;
  const std::string outcome(Name(status.last_outcome));
  const std::string because =
      status.last_reason.empty() ? outcome : outcome + " (" + status.last_reason + ")";
  std::string text;
  if (status.last_ok) {
    text = fmt::format("offline for {}: {}", FormatAge(now.instant - *status.last_ok), because);
  } else {
    const bool its_bytes = record.line->devices.size() == 1 && line.bytes_in > 0;
    const bool nothing = status.Count(Outcome::no_reply) == status.exchanges && !its_bytes &&
                         status.last_reason.empty();
    text = fmt::format("has never answered: {}; {} in {}", because,
                       nothing ? "not a byte came" : "nothing good came",
                       Plural(status.exchanges, "exchange"));
  }
  return text + "; " + Noticed(line, status) + "; " + RemedyOfAbsence(record);
}

std::string Lost(const config::Line& line, std::uint32_t times) {
  if (line.port.starts_with("tcp://")) {
    return fmt::format(
        "the connection was lost {}: look at the serial server (in use by another client, its "
        "connection limit, an inactivity time, its power) and at the network",
        Times(times));
  }
  return fmt::format("the open port was lost {}: loose plug, hub or power; the log has the times",
                     Times(times));
}

/// Of its latest exchanges, lest an outage be held against it for ever. A single one counts only
/// where it is no exception.
bool IsNotable(const DeviceStatus& status, Outcome outcome, double from) {
  const auto recent = static_cast<double>(status.recent.Count(outcome));
  if (recent == 0 || Share(recent, static_cast<double>(status.recent.size())) < from) return false;
  return recent > 1 || Share(status.Count(outcome), status.exchanges) >= from;
}

/// What fails now and then on a device that answers.
Sentences Failures(const DeviceRecord& record) {
  const DeviceStatus& status = record.status;
  Sentences found;
  const auto say = [&](Outcome outcome, double from, const std::string& remedy) {
    if (!IsNotable(status, outcome, from)) return;
    found.push_back(fmt::format("{} in {} of its last {} exchanges: {}", Name(outcome),
                                status.recent.Count(outcome), status.recent.size(), remedy));
  };
  say(Outcome::corrupt, kNotableShare,
      SerialOf(record).on_wire()
          ? "noise, bad termination or a bus without ground; if it is most of them, parity, data "
            "bits or checksum differ from the device's (" +
                SettingsOf(record) + ")"
          : RemedyOfDamage(record));
  say(Outcome::partial, kNotableShare,
      "answers stop half-way: raise its timing.gap if a radio or a serial server is in between, "
      "else check wiring");
  say(Outcome::unexpected, kNotableShare,
      "frames of another address or shape, or that may belong to another request: a second master, "
      "two devices with one address, answers that come too late, or a lost one where nothing tells "
      "answers apart (see trust_order); look at 'baudgate trace " +
          record.line->name + "'");
  // Late answers are no_reply too, and have a sentence of their own.
  if (!IsLate(status)) {
    say(Outcome::no_reply, kNotableShare,
        "it was off for a moment or misses requests: noise, or it is asked faster than it can "
        "(raise its poll or timing.quiet)");
  }
  say(Outcome::busy, kNotableBusy, "it asks to be asked later: raise its poll");
  for (const Outcome outcome : {Outcome::refused, Outcome::unsupported}) {
    const std::string reason = status.last_outcome == outcome && !status.last_reason.empty()
                                   ? " (" + status.last_reason + ")"
                                   : std::string();
    say(outcome, kNotableShare,
        "it does not have what the profile asks for" + reason + ": does the profile fit?");
  }
  return found;
}

constexpr std::string_view kAskLess = "raise poll, ask for fewer points, or raise the bit rate";

/// "feeder-1 has taken 62 % of the line's time with exchanges that fail (40 of its last 64): mend
/// that first".
std::string Waste(const LineDevices& devices, const std::string& name) {
  const DeviceStatus& status = devices.wasteful->status;
  const bool big = devices.waste >= kBigPart;
  const std::string part = Percent(devices.waste) + " of the line's time";
  const std::string latest =
      fmt::format("{} of its last {}", RecentFailures(status), status.recent.size());
  std::string what;
  if (IsAbsent(status)) {
    what = "does not answer and has taken " + part;
  } else if (big) {
    what = fmt::format("has taken {} with exchanges that fail ({})", part, latest);
  } else {
    what = "fails in " + latest + " exchanges";
  }
  const std::string then = big ? std::string() : fmt::format(", then {}", kAskLess);
  return name + " " + what + ": mend that first" + then;
}

std::string Missed(const LineStatus& line, const DeviceRecord& record, const LineDevices& devices,
                   double share) {
  std::string why;
  if (devices.wasteful != nullptr) {
    const config::Device* wasteful = devices.wasteful->device;
    why = Waste(devices, wasteful == record.device ? "it" : wasteful->name);
  } else if (line.use >= kFullLine) {
    why = fmt::format("the line is full (use {}); {}", Percent(line.use), kAskLess);
  } else {
    why = fmt::format(
        "a round takes longer than its period, or failures took the time; if the count grows, {}",
        kAskLess);
  }
  return fmt::format("missed {} of its periods since the start ({}): {}", Percent(share),
                     record.status.missed, why);
}

/// Some device of it misses periods.
std::string Full(const LineStatus& line, const LineDevices& devices) {
  const std::string why = devices.wasteful != nullptr
                              ? Waste(devices, devices.wasteful->device->name)
                              : fmt::format("more is asked than fits: {}", kAskLess);
  return fmt::format("full (use {}): {}", Percent(line.use), why);
}

/// It is not what it should be, so that no value of it is good.
bool IsForeign(const DeviceRecord& record) {
  return record.override_quality && ConcernsDevice(record.override_quality->reason);
}

/// Of a device that speaks when it likes.
Sentences Silence(const DeviceRecord& record, Now now) {
  const DeviceStatus& status = record.status;
  if (!status.last_ok) {
    return {
        "has not spoken yet: normal where nothing has happened; if something has, check power, "
        "bit rate, parity and wiring (" +
        record.line->serial.ToString() + ") and its options"};
  }
  Sentences found;
  if (const Duration silent = now.instant - *status.last_ok; silent >= kNotableSilence) {
    found.push_back("silent for " + FormatAge(silent) +
                    ": normal, it speaks only when it has something to say");
  }
  if (status.lost_events > 0) {
    found.push_back(Plural(status.lost_events, "event") +
                    " lost: it went on while the disk failed; see the events in 'baudgate status'");
  }
  return found;
}

/// Values that are not good although the device answers.
Sentences Points(const DeviceRecord& record, Now now) {
  if (IsForeign(record)) return {};  // that explains them all
  std::size_t stale = 0;
  std::size_t doubted = 0;
  std::size_t reported = 0;
  std::map<Reason, std::size_t> reasons;
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    const Quality quality = QualityAt(record, i, now.instant);
    if (IsGood(quality) || quality == Quality::bad_waiting) continue;
    // What the reading itself said is the device's word; the rest is doubt or age.
    const bool in_doubt = quality == Quality::uncertain && quality == record.points[i].at_best;
    const bool said = quality == record.points[i].reported;
    ++(said ? reported : in_doubt ? doubted : stale);
    if (said && quality.reason != Reason::none) ++reasons[quality.reason];
  }
  Sentences found;
  const std::string see = "see 'baudgate status " + NameOf(record) + "'";
  if (stale > 0) {
    found.push_back(
        fmt::format("{} of {} points are older than their max_age: its polls fail or "
                    "come too seldom; {}",
                    stale, record.points.size(), see));
  }
  if (doubted > 0) {
    found.push_back(
        fmt::format("{} of {} points are in doubt until they are read again: the port was opened "
                    "anew, the device was away, or a reply may have belonged to another request; "
                    "{}",
                    doubted, record.points.size(), see));
  }
  if (reported > 0) {
    std::string why;
    for (const auto& [reason, count] : reasons) {
      why += fmt::format("{}{} {}", why.empty() ? " (" : ", ", count, Name(reason));
    }
    if (!why.empty()) why += ")";
    found.push_back(fmt::format("{} of {} points are not good by the device's own report{}; {}",
                                reported, record.points.size(), why, see));
  }
  return found;
}

}  // namespace

std::string ClockText(WallTime time) { return FormatWallTime(time).substr(11, 8) + " UTC"; }

Sentences Diagnose(const LineStatus& line, const DeviceRecord& device, const LineDevices& devices,
                   Now now, Instant started) {
  const DeviceStatus& status = device.status;
  if (status.state == DeviceState::disabled) {
    if (!device.device->enabled) return {"disabled in the configuration (enabled: false)"};
    return {"taken out of use at run time; 'baudgate enable " + NameOf(device) +
            "' brings it back"};
  }
  if (line.port != LineStatus::Port::open) return {};
  if (status.unasked && status.exchanges == 0) return Silence(device, now);
  if (status.exchanges == 0) return {"not asked yet"};
  if (status.last_outcome == Outcome::line_down) {
    return {status.unasked ? "has not spoken since the port was opened: normal where nothing has "
                             "happened"
                           : "not asked since the port was opened"};
  }
  if (line.cut_since && IsAbsent(status)) {
    return {"can not be reached: the ring of line '" + device.line->name +
            "' is open; this says nothing about the device"};
  }
  if (IsAbsent(status)) return {Absence(line, device, now)};

  Sentences found = IsForeign(device) ? Sentences() : Failures(device);
  if (!status.trouble.empty()) {
    found.insert(found.begin(), (IsForeign(device) ? "no value is good: " : "") + status.trouble);
  }
  if (status.unasked) {
    for (std::string& sentence : Silence(device, now)) found.push_back(std::move(sentence));
  }
  const bool often_late = Share(status.late, status.exchanges) >= kNotableShare / 10;
  if (often_late || status.patience > Duration()) found.push_back(Late(status));
  if (status.doubled > 0) {
    found.push_back(fmt::format(
        "doubled: a second, different reply came behind one {}: replies come twice, or one request "
        "late; values may have been another's for a moment. Look at the serial server, radio or "
        "repeater in between",
        Times(status.doubled)));
  }
  if (const double share = MissedShare(device, now, started); share >= kNotableShare) {
    found.push_back(Missed(line, device, devices, share));
  }
  for (std::string& sentence : Points(device, now)) found.push_back(std::move(sentence));
  if (found.empty() && status.state == DeviceState::degraded) {
    found.push_back("degraded: several of its last 32 exchanges failed" +
                    (status.last_reason.empty() ? "" : "; last: " + status.last_reason));
  }
  return found;
}

Sentences DiagnoseLine(const config::Line& line, const LineStatus& status,
                       const LineDevices& devices, Now now) {
  if (status.port == LineStatus::Port::released) {
    return {
        fmt::format("released: the port is lent until {}; 'baudgate release {} --end' takes it "
                    "back",
                    ClockText(status.released_until), line.name)};
  }
  if (status.port == LineStatus::Port::closed) {
    const std::string since = status.port_since == WallTime{}
                                  ? std::string()
                                  : " for " + FormatAge(now.wall - status.port_since);
    return {fmt::format("port closed{}: {}; it is tried again until it works", since,
                        status.port_text.empty() ? "not opened yet" : status.port_text)};
  }
  Sentences found;
  if (status.cut_since) {
    found.push_back(fmt::format(
        "the ring is open since {}: requests used to come back and do no more; look for "
        "a loose or broken fibre, or a device on it without power. No device of the "
        "line can answer until then",
        ClockText(*status.cut_since)));
  } else if (devices.in_use > 1 && devices.absent == devices.in_use) {
    found.push_back(
        fmt::format("none of its {} devices answers: look at what they share: port, "
                    "bit rate and parity ({}), A and B swapped, power of the bus",
                    devices.in_use, line.serial.ToString()));
  }
  if (status.echoes > 0) {
    found.push_back(fmt::format("the request itself came back {}: set 'echo: strip' at the line",
                                Times(status.echoes)));
  }
  if (status.collisions > 0 && !status.cut_since) {
    found.push_back(
        fmt::format("the echo was missing or different {}: two talkers at once, or a "
                    "bus that does not echo (set 'echo: off')",
                    Times(status.collisions)));
  }
  if (status.parity_errors + status.framing_errors > 0) {
    found.push_back(
        fmt::format("{} parity and {} framing errors since the port was opened: bit "
                    "rate, parity or data bits differ ({}), or noise",
                    status.parity_errors, status.framing_errors, line.serial.ToString()));
  }
  if (status.overruns > 0) {
    found.push_back(
        fmt::format("the driver lost bytes {}: the machine is too busy, or the adapter "
                    "needs flow control (rtscts)",
                    Times(status.overruns)));
  }
  if (Share(static_cast<double>(status.stray_bytes), static_cast<double>(status.bytes_in)) >=
      kNotableStray) {
    found.push_back(
        fmt::format("{} of {} bytes came when nothing was asked: {}; look at 'baudgate trace {}'",
                    status.stray_bytes, status.bytes_in,
                    "a second master, answers that come too late, or noise", line.name));
  }
  if (status.times_lost > 0) found.push_back(Lost(line, status.times_lost));
  if (devices.misses && status.use >= kFullLine) found.push_back(Full(status, devices));
  return found;
}

}  // namespace baudgate::control
