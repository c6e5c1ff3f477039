// Sentences about a line and the use of its time. diagnose.h describes the functions.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "gateway/base/shown.h"
#include "gateway/base/system_trouble.h"
#include "gateway/diagnosis/causes/diagnose.h"
#include "gateway/diagnosis/causes/evidence.h"
#include "gateway/diagnosis/causes/hypotheses.h"
#include "gateway/diagnosis/causes/words.h"

namespace baudgate::diagnosis {
namespace {

using Sentences = std::vector<std::string>;

/// Stray bytes are reported from this share of all received bytes on.
constexpr double kNotableStray = 0.05;
/// Fewer stray bytes than this are not reported: they may be the greeting of a server.
constexpr std::uint64_t kFewStray = 32;
constexpr std::uint64_t kManyStray = 2048;
/// Errors that the driver counts are reported from this number per exchange on.
constexpr double kNotableErrors = 0.02;

Sentences DriverErrors(const config::Line& line, const bus::LineStatus& status, bool nobody) {
  Sentences found;
  const std::uint32_t errors = status.parity_errors + status.framing_errors;
  if (Share(errors, static_cast<double>(status.exchanges)) >= kNotableErrors) {
    found.push_back(fmt::format(
        "the driver has counted {} parity and {} framing errors since the port was opened. {}",
        status.parity_errors, status.framing_errors,
        nobody ? "Compare bit rate, parity and data bits (" + line.serial.ToString() +
                     ") with the settings of the devices"
               : std::string("Check for noise, bad termination, or a device with other settings")));
  }
  if (status.restored >= kFacts) {
    found.push_back(
        fmt::format("another program ({}) has changed the settings of the port {}, and the gateway "
                    "has restored them. Keep that program away from {}",
                    NameHolders(line.port), Times(status.restored), line.port));
  }
  if (status.overruns > 0) {
    found.push_back(
        fmt::format("the driver lost bytes {}. The machine is too busy, or the adapter needs flow "
                    "control (rtscts)",
                    Times(status.overruns)));
  }
  return found;
}

std::size_t InUse(std::span<const bus::DeviceRecord> devices) {
  return static_cast<std::size_t>(std::ranges::count_if(devices, [](const bus::DeviceRecord& one) {
    return one.status.state != bus::DeviceState::disabled;
  }));
}

/// Reports that no device of the line answers. Empty: no request has failed since the port was
/// opened.
Sentences NobodyAnswers(const bus::LineStatus& status, std::span<const bus::DeviceRecord> devices,
                        Now now) {
  const Evidence evidence = GatherAbsent(status, devices, now);
  if (evidence.failed == 0) return {};
  const std::string text = fmt::format("none of its {} devices answers", InUse(devices));
  const auto judged = Judge(evidence);
  if (judged.empty()) return {text + ". Check port, wiring and bit rate"};
  Sentences said = Besides(evidence, judged);
  said.insert(said.begin(), text + ": " + judged.front()->say(evidence));
  return said;
}

/// Reports text and other foreign messages on the line, whichever device was asked when they came.
Sentences Strangers(const config::Line& line, std::span<const bus::DeviceRecord> devices) {
  const auto seen = [&](std::initializer_list<Symptom> symptoms) -> const Finding* {
    const Finding* found = nullptr;
    std::size_t count = 0;
    for (const bus::DeviceRecord& one : devices) {
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
    said.push_back(device->cause + ", in addition to good replies" +
                   NextSentence(RemoveOther(line.is_network())) +
                   ", or check whether two devices have its address");
  }
  if (const Finding* text = seen({Symptom::text_beside})) {
    said.push_back(
        line.is_network()
            ? "text comes unasked (" + text->cause +
                  "). Switch off the heartbeat or registration packet of the radio or serial "
                  "server, or the automatic output of a device"
            : "text comes unasked on the line (" + text->cause +
                  "). Take the device that sends it off this line, or switch its automatic output "
                  "(heartbeat) off");
  }
  return said;
}

/// True if bytes come without end: at least three quarters of the replies of a device have bytes
/// around them, and over half of all received bytes (at least kManyStray) are stray.
bool IsEndless(const bus::LineStatus& status, std::span<const bus::DeviceRecord> devices) {
  return status.stray_bytes >= kManyStray && 2 * status.stray_bytes > status.bytes_in &&
         std::ranges::any_of(devices, [](const bus::DeviceRecord& one) {
           const bus::Findings& findings = one.status.findings;
           const std::size_t beside =
               findings.Count(Symptom::noise_before) + findings.Count(Symptom::noise_behind);
           return 4 * beside >= 3 * findings.size() && findings.size() > 0;
         });
}

/// True if late replies, or a sentence about a device, explain the stray bytes of the line.
bool IsExplained(const bus::LineStatus& line, std::span<const bus::DeviceRecord> devices) {
  constexpr std::uint64_t kLongReply = 300;
  std::uint64_t late = 0;
  for (const bus::DeviceRecord& one : devices) late += one.status.late;
  if (late * kLongReply >= line.stray_bytes) return true;
  return std::ranges::any_of(devices, [](const bus::DeviceRecord& one) {
    if (one.status.late >= kFacts) return true;
    for (std::size_t i = 1; i < kSymptoms; ++i) {
      const auto symptom = static_cast<Symptom>(i);
      const std::size_t notable = IsAnswered(symptom) ? kNotableNoise : kFacts;
      if (symptom != Symptom::silence && one.status.findings.Count(symptom) >= notable) return true;
    }
    return false;
  });
}

/// True if a device answers, now or a short time ago.
bool AnyAnswers(std::span<const bus::DeviceRecord> devices, Now now) {
  return std::ranges::any_of(devices, [&](const bus::DeviceRecord& one) {
    return Answers(one.status.state) || HasAnsweredLately(one.status, now.instant);
  });
}

/// Reports echoes that are missing, or that come but are not configured. Also reports a line on
/// which no device answers.
Sentences AboutEchoes(const bus::LineStatus& status, std::span<const bus::DeviceRecord> devices,
                      Now now) {
  Sentences found;
  const bool nobody = AbsentTogether(devices);
  const bool echoless = status.collisions > 0 && 2 * status.collisions >= status.exchanges;
  if (status.cut_since) {
    found.push_back(
        fmt::format("the ring has been open since {}: requests no longer come back as an echo. "
                    "Look for a loose or broken fibre, or a device on the ring without power",
                    ClockText(*status.cut_since)));
  } else if (nobody && echoless) {
    found.push_back(
        fmt::format("none of its {} devices answers, and requests do not come back as an echo ({}, "
                    "echo: verify). Close the ring (a loose fibre, a device without power), or set "
                    "'echo: off' for a bus without echo",
                    InUse(devices), Times(status.collisions)));
  } else if (nobody) {
    found = NobodyAnswers(status, devices, now);
  }
  if (Echoes(status) && AnyAnswers(devices, now)) {
    found.push_back(fmt::format(
        "the request itself came back {}. Set 'echo: strip' at the line in the configuration",
        Times(status.echoes)));
  }
  if (status.collisions > 0 && !status.cut_since && !(nobody && echoless)) {
    found.push_back(fmt::format(
        "the echo was missing, or differed from the request, {}. Two masters send at once, or {}",
        Times(status.collisions),
        echoless ? "the bus does not echo (set 'echo: off' at the line)"
                 : "the ring opens now and then (a loose plug, or a device that restarts)"));
  }
  return found;
}

/// Returns a sentence about stray bytes. Empty: the stray bytes are few, or another sentence
/// explains them.
std::string StrayBytes(const config::Line& line, const bus::LineStatus& status,
                       std::span<const bus::DeviceRecord> devices) {
  const double stray =
      Share(static_cast<double>(status.stray_bytes), static_cast<double>(status.bytes_in));
  if (stray < kNotableStray || status.stray_bytes < kFewStray) return {};
  if (IsExplained(status, devices) || Echoes(status)) return {};
  return fmt::format(
      "{} of {} bytes came when nothing was asked. {}", status.stray_bytes, status.bytes_in,
      line.is_network() && line.serial.on_wire() ? "Switch off packets of the serial server itself "
                                                   "(heartbeat), or look for noise behind it"
      : line.serial.on_wire() ? "Look for noise between the replies (bias resistors, termination), "
                                "or for a second master"
                              : "Update the firmware of the server, which answers twice or does "
                                "not keep to Modbus TCP");
}

/// Returns a sentence that explains missed polls. Empty: no polls are missed, or a sentence about a
/// device explains them.
std::string MissedPolls(const bus::LineStatus& status, std::span<const bus::DeviceRecord> devices,
                        Now now, Instant started) {
  const bool told = std::ranges::any_of(devices, [](const bus::DeviceRecord& one) {
    // There is a sentence about each device that refuses most requests, or that is offline.
    const bool refuses = 2 * one.status.findings.Count(Symptom::refusal) >= bus::Findings::kKept;
    return refuses || (one.status.last_ok && IsAbsent(one.status));
  });
  if (told) return {};
  const bool misses = std::ranges::any_of(devices, [&](const bus::DeviceRecord& one) {
    return Answers(one.status.state) && MissedShare(one, now, started) > 0;
  });
  const std::string why =
      misses ? WhyNoTime(status, devices, nullptr, now, started) : std::string();
  return why.empty() ? SayEndsEach(status, devices, now) : "polls are missed: " + why;
}

}  // namespace

Sentences DiagnoseLine(const config::Line& line, const bus::LineStatus& status,
                       std::span<const bus::DeviceRecord> devices, Now now, Instant started) {
  Sentences found;
  const auto add = [&found](Sentences more) {
    for (std::string& sentence : more) found.push_back(std::move(sentence));
  };
  const auto add_one = [&found](std::string sentence) {
    if (!sentence.empty()) found.push_back(std::move(sentence));
  };
  for (const bus::PortService& service : status.services) {
    if (service.trouble.empty()) continue;
    found.push_back(
        fmt::format("no client can connect to its port at {}: {}; the gateway tries again",
                    service.place, service.trouble));
  }
  if (status.port != bus::LineStatus::Port::open) {
    found.insert(found.begin(), SayClosed(line, status, devices, now));
    return found;
  }
  add(AboutEchoes(status, devices, now));
  if (status.negotiations > 0 && AnyAnswers(devices, now)) {
    found.push_back(
        "the server speaks Telnet when a connection begins, and doubles each FF. Set its port to "
        "raw TCP, without Telnet or RFC 2217");
  }
  add(Strangers(line, devices));
  add(DriverErrors(line, status, AbsentTogether(devices)));
  if (IsEndless(status, devices)) {
    found.push_back(
        "bytes come without an end, also when nothing was asked. A device or converter keeps "
        "sending: unplug them one by one");
  }
  add_one(StrayBytes(line, status, devices));
  add(AboutLosses(line, status, devices, now));
  add_one(MissedPolls(status, devices, now, started));
  return found;
}

namespace {

constexpr int kMinutes = 5;
/// Fewer missed poll periods than this are not reported; some are normal after a start.
constexpr std::uint32_t kNotableMisses = 3;
constexpr double kNotableMissed = 0.02;
/// Failed exchanges of a device that take this share of the line's time are the cause of missed
/// polls.
constexpr double kMuchWaste = 0.2;
/// Failed exchanges that take this share of the line's time may cause some missed polls.
constexpr double kSomeWaste = 0.03;
/// Good exchanges that take this share of the line's time are the cause of missed polls.
constexpr double kFull = 0.8;
constexpr double kBusy = 0.5;
constexpr double kMuchOfOne = 0.4;
/// A configured silence before requests that is longer than any protocol needs.
constexpr Duration kLongQuiet = 50ms;
/// A device stands out if it takes more than this multiple of the average time per device.
constexpr double kMoreThanOthers = 1.25;

/// Returns how many seconds the counts of the last five minutes cover, because the program may have
/// started later.
double Watched(Now now, Instant started) {
  const Duration of_minute = now.instant.time_since_epoch() % 1min;
  return Seconds(std::min<Duration>(now.instant - started, of_minute + (kMinutes - 1) * 1min));
}

/// True if the characters on the wire take more than half of the time of exchanges.
bool IsWireTime(const bus::LineStatus& status, const config::Line& line) {
  const auto characters = static_cast<std::int64_t>(status.bytes_in + status.bytes_out);
  return 2 * characters * line.serial.CharacterTime() > status.busy;
}

/// True if, at all devices, the configured silence before a request is long (kLongQuiet) and longer
/// than the exchange.
bool IsQuietTime(std::span<const bus::DeviceRecord> devices) {
  return std::ranges::all_of(devices, [](const bus::DeviceRecord& one) {
    const std::optional<Duration>& quiet = one.status.timing.quiet;
    return quiet && *quiet >= kLongQuiet && *quiet > one.status.round_trips.mean();
  });
}

bool FailsOften(const bus::DeviceRecord& record) {
  return FailedOf(record.status) >= kNotableFailures;
}

}  // namespace

double MissedShare(const bus::DeviceRecord& device, Now now, Instant started) {
  const bus::MinuteCounts tally = device.status.hour.Sum(now.instant, kMinutes - 1);
  if (tally.missed < kNotableMisses) return 0;
  const double periods = Watched(now, started) / Seconds(device.device->poll);
  const double share = periods > 0 ? std::min(tally.missed / periods, 1.0) : 0;
  return share < kNotableMissed ? 0 : share;
}

std::string WhyNoTime(const bus::LineStatus& line, std::span<const bus::DeviceRecord> devices,
                      const bus::DeviceRecord* device, Now now, Instant started) {
  const double watched = std::max(Watched(now, started), 1e-3);
  const bus::DeviceRecord* wasteful = nullptr;
  const bus::DeviceRecord* busiest = nullptr;
  double waste = 0;
  double most = 0;
  double served = 0;
  for (const bus::DeviceRecord& one : devices) {
    const bus::MinuteCounts tally = one.status.hour.Sum(now.instant, kMinutes - 1);
    served += Seconds(tally.served) / watched;
    if (const double its = Seconds(tally.wasted) / watched; its > waste) {
      waste = its;
      wasteful = &one;
    }
    if (const double its = Seconds(tally.served) / watched; its > most) {
      most = its;
      busiest = &one;
    }
  }
  const auto name = [device](const bus::DeviceRecord& one) {
    return device != nullptr && one.device == device->device ? "it" : one.device->name;
  };
  const bool disturbed = std::ranges::any_of(devices, [](const bus::DeviceRecord& one) {
    const bus::Findings& findings = one.status.findings;
    return findings.Count(Symptom::other_master) + findings.Count(Symptom::master_beside) > 1;
  });
  if (disturbed) return {};  // the line has a sentence about the other master
  // A sentence about this device reports its failures.
  if (device != nullptr && FailsOften(*device)) return {};
  // A sentence about the wasteful device reports its failures.
  if (waste >= kMuchWaste && (device == nullptr || wasteful->device == device->device)) return {};
  // The time was lost to stray bytes beside good replies, so there is no failure to report.
  if (waste >= kMuchWaste && !FailsOften(*wasteful)) return {};
  if (waste >= kMuchWaste) {
    return fmt::format(
        "{} takes {} of the line's time with exchanges that fail. First follow the sentence about "
        "that device",
        name(*wasteful), Percent(waste));
  }
  // A sentence about the late device names its remedy.
  if (device == nullptr && busiest != nullptr && busiest->status.patience > Duration()) return {};
  const bool wire = !devices.empty() && IsWireTime(line, *devices.front().line);
  const char* const ask_less =
      wire ? "ask for fewer points, or raise the bit rate" : "ask for fewer points";
  const bool stands_out = most * static_cast<double>(devices.size()) > kMoreThanOthers * served;
  if (most >= kMuchOfOne && devices.size() > 1 && stands_out) {
    const auto each = busiest->status.round_trips.mean();
    return fmt::format(
        "{} takes {} of the line's time, {} ms per exchange. Poll it less often (poll), or {}",
        name(*busiest), Percent(most), Milliseconds(each), ask_less);
  }
  if (served >= kFull && IsQuietTime(devices)) {
    return fmt::format(
        "the polls need more time than the line has, and half of the time is silence before "
        "requests. Lower timing.quiet ({}), or poll less often (poll)",
        FormatDuration(*devices.front().status.timing.quiet));
  }
  if (served >= kFull) {
    return fmt::format(
        "the polls need more time than the line has, because good exchanges take {} of the time. "
        "Poll less often (poll), or {}",
        Percent(served), ask_less);
  }
  if (served < kBusy || waste >= kSomeWaste) return {};
  return fmt::format(
      "one round of polls takes longer than the poll period. Poll less often (poll), or {}",
      ask_less);
}

}  // namespace baudgate::diagnosis
