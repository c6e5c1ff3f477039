// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "gateway/base/port_holders.h"
#include "gateway/base/shown.h"
#include "gateway/diagnosis/causes/diagnose.h"
#include "gateway/diagnosis/causes/diagnose_parts.h"
#include "gateway/diagnosis/causes/evidence.h"
#include "gateway/diagnosis/causes/hypotheses.h"
#include "gateway/diagnosis/causes/words.h"

namespace baudgate::control {
namespace {

using Sentences = std::vector<std::string>;

/// So much of a line's incoming bytes may be stray before it is said.
constexpr double kNotableStray = 0.05;
/// A greeting of a server is no noise.
constexpr std::uint64_t kFewStray = 32;
constexpr std::uint64_t kManyStray = 2048;
/// So many errors of the driver for an exchange.
constexpr double kNotableErrors = 0.02;

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
  if (status.restored >= kFacts) {
    found.push_back(fmt::format(
        "another program ({}) has changed the settings of the port {} (they were set again): keep "
        "it away from {}",
        NameHolders(line.port), Times(status.restored), line.port));
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
        const bool told = IsWrapped(one) || one.status.findings.Starts() > 0;
        if (symptom == Symptom::text_beside && told) continue;
        count += its;
        if (its > 0) found = &one.status.findings.Last(symptom);
      }
    }
    return count >= kFacts ? found : nullptr;
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
    if (one.status.late >= kFacts) return true;
    for (std::size_t i = 1; i < kSymptoms; ++i) {
      const auto symptom = static_cast<Symptom>(i);
      const std::size_t notable = IsAnswered(symptom) ? kNotableNoise : kFacts;
      if (symptom != Symptom::silence && one.status.findings.Count(symptom) >= notable) return true;
    }
    return false;
  });
}

/// If no device answers, their own sentences tell of the echo.
bool AnyAnswers(std::span<const DeviceRecord> devices, Now now) {
  return std::ranges::any_of(devices, [&](const DeviceRecord& one) {
    return Answers(one.status.state) || HasAnsweredLately(one.status, now.instant);
  });
}

/// Echoes that are missing, or come where none is wanted; and devices of which none answers.
Sentences AboutEchoes(const LineStatus& status, std::span<const DeviceRecord> devices, Now now) {
  Sentences found;
  const bool nobody = AbsentTogether(devices);
  const bool echoless = status.collisions > 0 && 2 * status.collisions >= status.exchanges;
  if (status.cut_since) {
    found.push_back(fmt::format(
        "the ring is open since {}, as requests come back no more: look for a loose or broken "
        "fibre, or a device on it without power",
        ClockText(*status.cut_since)));
  } else if (nobody && echoless) {
    found.push_back(fmt::format(
        "none of its {} devices answers, and requests do not come back ({}, echo: verify): is the "
        "ring open (a loose fibre, a device without power)? If the bus has no echo, set 'echo: "
        "off' in the configuration",
        InUse(devices), Times(status.collisions)));
  } else if (nobody) {
    found = NobodyAnswers(status, devices, now);
  }
  if (Echoes(status) && AnyAnswers(devices, now)) {
    found.push_back(
        fmt::format("the request itself came back {}: set 'echo: strip' in the configuration",
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
  return found;
}

/// Empty: they are few, or something else explains them.
std::string StrayBytes(const config::Line& line, const LineStatus& status,
                       std::span<const DeviceRecord> devices) {
  const double stray =
      Share(static_cast<double>(status.stray_bytes), static_cast<double>(status.bytes_in));
  if (stray < kNotableStray || status.stray_bytes < kFewStray) return {};
  if (IsExplained(status, devices) || Echoes(status)) return {};
  return fmt::format(
      "{} of {} bytes came when nothing was asked: {}", status.stray_bytes, status.bytes_in,
      line.is_network() && line.serial.on_wire()
          ? "packets of the serial server itself (heartbeat), or noise behind it"
      : line.serial.on_wire()
          ? "noise between the replies (check bias resistors and termination), or a second master"
          : "the server answers twice, or does not keep to Modbus TCP; update its firmware");
}

/// Why polls are missed. Empty: none is, or a device tells it.
std::string MissedPolls(const LineStatus& status, std::span<const DeviceRecord> devices, Now now,
                        Instant started) {
  const bool told = std::ranges::any_of(devices, [](const DeviceRecord& one) {
    // One that says no to most of what it is asked, or that is absent, has a sentence of its own.
    const bool refuses = 2 * one.status.findings.Count(Symptom::refusal) >= Findings::kKept;
    return refuses || (one.status.last_ok && IsAbsent(one.status));
  });
  if (told) return {};
  const bool misses = std::ranges::any_of(devices, [&](const DeviceRecord& one) {
    return Answers(one.status.state) && MissedShare(one, now, started) > 0;
  });
  const std::string why =
      misses ? WhyNoTime(status, devices, nullptr, now, started) : std::string();
  return why.empty() ? SayEndsEach(status, devices, now) : "polls are missed: " + why;
}

}  // namespace

Sentences DiagnoseLine(const config::Line& line, const LineStatus& status,
                       std::span<const DeviceRecord> devices, Now now, Instant started) {
  Sentences found;
  const auto add = [&found](Sentences more) {
    for (std::string& sentence : more) found.push_back(std::move(sentence));
  };
  const auto add_one = [&found](std::string sentence) {
    if (!sentence.empty()) found.push_back(std::move(sentence));
  };
  for (const PortService& service : status.services) {
    if (service.trouble.empty()) continue;
    found.push_back(fmt::format("no client can come in for its port at {}: {}; it is tried again",
                                service.place, service.trouble));
  }
  if (status.port != LineStatus::Port::open) {
    found.insert(found.begin(), SayClosed(line, status, devices, now));
    return found;
  }
  add(AboutEchoes(status, devices, now));
  if (status.negotiations > 0 && AnyAnswers(devices, now)) {
    found.push_back(
        "the server speaks Telnet when a connection begins, and doubles each FF: set its port to "
        "raw TCP, without Telnet or RFC 2217");
  }
  add(Strangers(line, devices));
  add(DriverErrors(line, status, AbsentTogether(devices)));
  if (IsEndless(status, devices)) {
    found.push_back(
        "bytes come without an end, also when nothing was asked: a device or converter keeps "
        "sending; unplug them one by one");
  }
  add_one(StrayBytes(line, status, devices));
  add(AboutLosses(line, status, devices, now));
  add_one(MissedPolls(status, devices, now, started));
  return found;
}

}  // namespace baudgate::control
