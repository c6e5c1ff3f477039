// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "gateway/base/shown.h"
#include "gateway/status/connection_words.h"
#include "gateway/status/diagnose.h"
#include "gateway/status/diagnose_beside.h"
#include "gateway/status/evidence.h"
#include "gateway/status/hypotheses.h"
#include "gateway/status/line_time.h"
#include "gateway/status/reason.h"
#include "gateway/status/words.h"

namespace baudgate::control {
namespace {

using Sentences = std::vector<std::string>;

/// So much of a line's incoming bytes may be stray before it is said.
constexpr double kNotableStray = 0.05;
/// A greeting of a server is no noise.
constexpr std::uint64_t kFewStray = 32;
constexpr std::uint64_t kManyStray = 2048;
/// Once may be chance.
constexpr std::size_t kProof = 2;
/// A server that ends so many connections in use does not do so by its settings alone.
constexpr std::size_t kDrops = 3;
constexpr Duration kRecently = 5min;
constexpr int kLastMinutes = 4;
/// What a server loses in so short a time is one restart.
constexpr Duration kRestart = 10s;
/// A connection is opened again so soon.
constexpr Duration kMoment = 15s;
/// So many errors of the driver for an exchange.
constexpr double kNotableErrors = 0.02;

/// What answers there in place of a device; null: nothing that is known.
const Finding* OtherService(std::span<const DeviceRecord> devices) {
  for (const DeviceRecord& one : devices) {
    for (const Symptom symptom : {Symptom::other_protocol, Symptom::text}) {
      if (one.status.findings.Count(symptom) > 0) return &one.status.findings.Last(symptom);
    }
  }
  return nullptr;
}

/// Empty: none is there.
std::string SayOtherService(const config::Line& line, std::span<const DeviceRecord> devices) {
  const Finding* const other = OtherService(devices);
  if (other == nullptr || !line.port.starts_with("tcp://")) return {};
  const bool says = other->symptom == Symptom::text;
  return (says ? line.port + " says " + other->cause + ": "
               : "no device is behind " + line.port + " (" + other->cause + "): ") +
         (other->remedy.empty() ? "check the port" : other->remedy);
}

/// No device has ever answered, and what came broke off with its connection. Empty: it is not so.
std::string SayEndsInside(const config::Line& line, std::span<const DeviceRecord> devices) {
  const auto breaks_off = [](const DeviceRecord& one) {
    return !one.status.last_ok && one.status.findings.Count(Symptom::tail_lost) >= kDrops;
  };
  if (!line.is_network() || !std::ranges::any_of(devices, breaks_off)) return {};
  return "the server closes the connection inside replies: look at it and the device behind it "
         "(firmware, limits)";
}

/// Why a port holds what is sent.
const char* WhyNoData(const config::SerialSettings& serial) {
  if (serial.rtscts) return "it takes no data: is the CTS line of the device connected and active?";
  if (serial.xonxoff) {
    return "it takes no data: XOFF came, and no XON since: switch XON/XOFF off at both ends";
  }
  return "it takes no data: the adapter, or what is behind it, hangs: plug it in anew or restart "
         "it";
}

std::string Lost(const config::Line& line, const LineStatus& status, std::size_t times,
                 std::span<const DeviceRecord> devices, Instant now) {
  if (std::string other = SayOtherService(line, devices); !other.empty()) return other;
  if (std::string inside = SayEndsInside(line, devices); !inside.empty()) return inside;
  if (line.is_network()) {
    return fmt::format("the connection was lost {} in the last hour: {}", Times(times),
                       WhyEnded(status, now - 1h, false));
  }
  return fmt::format("the open port was lost {} in the last hour: {}", Times(times),
                     status.takes_no_data ? WhyNoData(line.serial)
                                          : "loose plug, hub or power; the log has the times");
}

/// In the last hour. A server that restarts accepts and ends connections meanwhile.
std::size_t LossesOf(const config::Line& line, const LineStatus& status, Now now) {
  return status.losses.Since(now.instant - 1h, line.is_network() ? kRestart : Duration());
}

/// An update of a server ends one or two connections. A server that goes away twice in two minutes
/// has a fault.
bool IsLostOften(const config::Line& line, const LineStatus& status, std::size_t lost, Now now) {
  if (!line.is_network()) return lost > 0;
  const auto twice = [&](const RecentTimes& what) {
    return what.Since(now.instant - 2min, kRestart) >= kProof;
  };
  return lost >= kDrops || twice(status.ends.refused) || twice(status.ends.unreachable);
}

std::string Closed(const config::Line& line, const LineStatus& status,
                   std::span<const DeviceRecord> devices, Now now) {
  if (status.port == LineStatus::Port::released && status.lent_to_client) {
    return fmt::format(
        "{} until {}, its points are out of service; 'baudgate release {} --end' takes it back",
        status.port_text, ClockText(status.released_until), line.name);
  }
  if (status.port == LineStatus::Port::released) {
    return fmt::format(
        "released: the port is lent until {}; 'baudgate release {} --end' takes it back",
        ClockText(status.released_until), line.name);
  }
  if (std::string other = SayOtherService(line, devices); !other.empty()) return other;
  if (std::string inside = SayEndsInside(line, devices); !inside.empty()) return inside;
  // Made anew as nobody answers: that is what is wrong.
  const auto absent = [](const DeviceRecord& one) { return IsAbsent(one.status); };
  if (status.silent && std::ranges::any_of(devices, absent)) {
    const Evidence evidence = GatherAbsent(status, devices, now);
    const auto judged = Judge(evidence);
    if (!judged.empty()) return "nobody answers: " + judged.front()->say(evidence);
  }
  const Duration closed = now.wall - status.port_since;
  const std::size_t lost = LossesOf(line, status, now);
  const bool again = status.port_since != WallTime{} && closed < kMoment;
  // A server that has never let a device answer is told by its own reason.
  const auto answered = [](const DeviceRecord& one) { return one.status.last_ok.has_value(); };
  const bool worked = std::ranges::any_of(devices, answered);
  const bool often =
      line.is_network() ? worked && IsLostOften(line, status, lost, now) : lost >= kProof;
  if (again && often) return Lost(line, status, lost, devices, now.instant);
  const std::string since =
      status.port_since == WallTime{} ? std::string() : " for " + FormatAge(closed);
  return fmt::format("port closed{}: {}", since,
                     status.port_text.empty() ? "not opened yet" : status.port_text);
}

/// A server that ends connections which are in use.
std::string Dropped(const LineStatus& status, Now now) {
  const std::size_t times = status.drops.Since(now.instant - kRecently);
  if (times < kDrops) return {};
  return fmt::format(
      "the server has ended the connection {} in the last minutes while it was in use: {}",
      Times(times), WhyEnded(status, now.instant - kRecently, true));
}

/// A server that ends the connection behind each answer, where that costs polls. Empty: it is not
/// so.
std::string EndsEach(const LineStatus& status, std::span<const DeviceRecord> devices, Now now) {
  constexpr std::uint64_t kMany = 8;
  if (status.rests < kMany || 2 * status.rests < status.exchanges) return {};
  MinuteCounts tally;
  for (const DeviceRecord& one : devices) tally += one.status.hour.Sum(now.instant, kLastMinutes);
  if (tally.missed + tally.failed < kDrops) return {};
  return fmt::format(
      "the server ends the connection behind each answer, and {} polls were missed or failed: set "
      "it to keep the connection open (its inactivity time, its mode)",
      tally.missed + tally.failed);
}

/// Errors that the driver has counted.
Sentences DriverErrors(const config::Line& line, const LineStatus& status, bool nobody) {
  Sentences found;
  const std::uint32_t errors = status.parity_errors + status.framing_errors;
  if (Share(errors, static_cast<double>(status.exchanges)) >= kNotableErrors) {
    found.push_back(fmt::format(
        "the driver has counted {} parity and {} framing errors since the port was opened: {}",
        status.parity_errors, status.framing_errors,
        nobody ? "bit rate, parity or data bits differ (" + line.serial.ToString() + ")"
               : std::string("noise, bad termination, or a device with settings of its own")));
  }
  if (status.restored >= kProof) {
    found.push_back(fmt::format(
        "another program has changed the settings of the port {} (they were set again): keep it "
        "away from {}; 'baudgate ports' helps to find it",
        Times(status.restored), line.port));
  }
  if (status.overruns > 0) {
    found.push_back(fmt::format(
        "the driver lost bytes {}: the machine is too busy, or the adapter needs flow control "
        "(rtscts)",
        Times(status.overruns)));
  }
  return found;
}

std::size_t InUse(std::span<const DeviceRecord> devices) {
  return static_cast<std::size_t>(std::ranges::count_if(
      devices, [](const DeviceRecord& one) { return one.status.state != DeviceState::disabled; }));
}

/// Empty: none of them was asked in vain, as right behind a loan of the port.
Sentences NobodyAnswers(const LineStatus& status, std::span<const DeviceRecord> devices, Now now) {
  const Evidence evidence = GatherAbsent(status, devices, now);
  if (evidence.failed == 0) return {};
  const std::string text = fmt::format("none of its {} devices answers: ", InUse(devices));
  const auto judged = Judge(evidence);
  if (judged.empty()) return {text + "look at what they share: port, wiring, bit rate"};
  Sentences said = Besides(evidence, judged);
  said.insert(said.begin(), text + judged.front()->say(evidence));
  return said;
}

/// What somebody else says on the line, whichever device was asked meanwhile.
Sentences Strangers(const config::Line& line, std::span<const DeviceRecord> devices) {
  const auto seen = [&](std::initializer_list<Symptom> symptoms) -> const Finding* {
    const Finding* found = nullptr;
    std::size_t count = 0;
    for (const DeviceRecord& one : devices) {
      for (const Symptom symptom : symptoms) {
        const std::size_t its = one.status.findings.Count(symptom);
        if (symptom == Symptom::text_beside && IsWrapped(one)) continue;
        count += its;
        if (its > 0) found = &one.status.findings.Last(symptom);
      }
    }
    return count >= kProof ? found : nullptr;
  };
  Sentences said;
  if (const Finding* master = seen({Symptom::master_beside, Symptom::other_master})) {
    said.push_back(WithRemedy(*master));
  } else if (const Finding* device = seen({Symptom::device_beside})) {
    said.push_back(device->cause + ", beside good replies: " + AnotherAsksIt(line.is_network()) +
                   ", or two devices have its address");
  }
  if (const Finding* text = seen({Symptom::text_beside})) {
    said.push_back(
        line.is_network()
            ? "text comes by itself (" + text->cause +
                  "): a heartbeat or registration packet of the radio or serial server, or a "
                  "device: switch it off"
            : "something on the line sends text by itself (" + text->cause +
                  "): take it off this line, or switch its automatic output (heartbeat) off");
  }
  return said;
}
/// Bytes stand around nearly all replies, and more come than belong to replies.
bool IsEndless(const LineStatus& status, std::span<const DeviceRecord> devices) {
  return status.stray_bytes >= kManyStray && 2 * status.stray_bytes > status.bytes_in &&
         std::ranges::any_of(devices, [](const DeviceRecord& one) {
           const Findings& findings = one.status.findings;
           const std::size_t beside =
               findings.Count(Symptom::noise_before) + findings.Count(Symptom::noise_behind);
           return 4 * beside >= 3 * findings.size() && findings.size() > 0;
         });
}

/// A word of the devices explains them.
bool IsExplained(const LineStatus& line, std::span<const DeviceRecord> devices) {
  constexpr std::uint64_t kLongReply = 300;
  std::uint64_t late = 0;
  for (const DeviceRecord& one : devices) late += one.status.late;
  if (late * kLongReply >= line.stray_bytes) return true;
  return std::ranges::any_of(devices, [](const DeviceRecord& one) {
    if (one.status.late >= kProof) return true;
    for (std::size_t i = 1; i < kSymptoms; ++i) {
      const auto symptom = static_cast<Symptom>(i);
      const std::size_t notable = IsAnswered(symptom) ? kNotableNoise : kProof;
      if (symptom != Symptom::silence && one.status.findings.Count(symptom) >= notable) return true;
    }
    return false;
  });
}

}  // namespace

Sentences DiagnoseLine(const config::Line& line, const LineStatus& status,
                       std::span<const DeviceRecord> devices, Now now, Instant started) {
  Sentences found;
  for (const PortService& service : status.services) {
    if (!service.trouble.empty()) {
      found.push_back(fmt::format("no client can come in for its port at {}: {}; it is tried again",
                                  service.place, service.trouble));
    }
  }
  if (status.port != LineStatus::Port::open) {
    found.insert(found.begin(), Closed(line, status, devices, now));
    return found;
  }
  const bool nobody = AbsentTogether(devices);
  const bool echoless = status.collisions > 0 && 2 * status.collisions >= status.exchanges;
  if (status.cut_since) {
    found.push_back(fmt::format(
        "the ring is open since {}, as requests come back no more: look for a loose or broken "
        "fibre, or a device on it without power",
        ClockText(*status.cut_since)));
  } else if (nobody && echoless) {
    found.push_back(fmt::format(
        "none of its {} devices answers, and requests do not come back ({}, echo: verify): if the "
        "bus has no echo, set 'echo: off' at the line; else look for two talkers at once",
        InUse(devices), Times(status.collisions)));
  } else if (nobody) {
    found = NobodyAnswers(status, devices, now);
  }
  // A device that answers no more than the echo says it itself.
  const bool answered = std::ranges::any_of(devices, [&](const DeviceRecord& one) {
    return Answers(one.status.state) || HasAnsweredLately(one.status, now.instant);
  });
  if (Echoes(status) && answered) {
    found.push_back(fmt::format("the request itself came back {}: set 'echo: strip' at the line",
                                Times(status.echoes)));
  }
  if (status.collisions > 0 && !status.cut_since && !(nobody && echoless)) {
    found.push_back(fmt::format(
        "the echo was missing or different {}: two talkers at once, or {}",
        Times(status.collisions),
        echoless
            ? "a bus that does not echo (set 'echo: off')"
            : "a ring or bus that opens now and then: a loose plug, or a device that restarts"));
  }
  if (status.negotiations > 0 && answered) {
    found.push_back(
        "the server speaks Telnet when a connection begins, and doubles each FF: set its port to "
        "raw TCP, without Telnet or RFC 2217");
  }
  for (std::string& sentence : Strangers(line, devices)) found.push_back(std::move(sentence));
  for (std::string& sentence : DriverErrors(line, status, nobody)) {
    found.push_back(std::move(sentence));
  }
  if (IsEndless(status, devices)) {
    found.push_back(
        "bytes come without an end, also when nothing was asked: a device or converter keeps "
        "sending; unplug them one by one");
  }
  const double stray =
      Share(static_cast<double>(status.stray_bytes), static_cast<double>(status.bytes_in));
  if (stray >= kNotableStray && status.stray_bytes >= kFewStray && !IsExplained(status, devices) &&
      !Echoes(status)) {
    found.push_back(fmt::format(
        "{} of {} bytes came when nothing was asked: {}", status.stray_bytes, status.bytes_in,
        line.is_network() && line.serial.on_wire()
            ? "packets of the serial server itself (heartbeat), or noise behind it"
        : line.serial.on_wire()
            ? "noise between the replies (check bias resistors and termination), or a second "
              "master"
            : "the server answers twice, or does not keep to Modbus TCP; update its firmware"));
  }
  const std::size_t lost = LossesOf(line, status, now);
  if (IsLostOften(line, status, lost, now))
    found.push_back(Lost(line, status, lost, devices, now.instant));
  // One unit that is closed for has a sentence of its own.
  const bool told = std::ranges::any_of(devices, [](const DeviceRecord& one) {
    return !one.status.last_ok && one.status.findings.Last(Symptom::silence).ended;
  });
  if (std::string dropped = Dropped(status, now); lost < kDrops && !told && !dropped.empty()) {
    found.push_back(std::move(dropped));
  }
  // One that says no to most of what it is asked has a sentence of its own.
  const bool refuses = std::ranges::any_of(devices, [](const DeviceRecord& one) {
    return 2 * one.status.findings.Count(Symptom::refusal) >= Findings::kKept;
  });
  // An absent device has a sentence that names the cause.
  const bool gone = std::ranges::any_of(
      devices, [](const DeviceRecord& one) { return one.status.last_ok && IsAbsent(one.status); });
  const bool misses =
      !refuses && !gone && std::ranges::any_of(devices, [&](const DeviceRecord& one) {
        return Answers(one.status.state) && MissedShare(one, now, started) > 0;
      });
  const std::string why =
      misses ? WhyNoTime(status, devices, nullptr, now, started) : std::string();
  if (!why.empty()) found.push_back("polls are missed: " + why);
  if (std::string ends = EndsEach(status, devices, now);
      why.empty() && !gone && !refuses && !ends.empty()) {
    found.push_back(std::move(ends));
  }
  return found;
}

}  // namespace baudgate::control
