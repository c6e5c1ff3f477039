// Sentences about a port or connection that is closed, was lost, or was ended by the server.
// diagnose.h describes the functions.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "gateway/base/shown.h"
#include "gateway/diagnosis/causes/diagnose.h"
#include "gateway/diagnosis/causes/evidence.h"
#include "gateway/diagnosis/causes/hypotheses.h"
#include "gateway/diagnosis/causes/words.h"

namespace baudgate::diagnosis {
namespace {

using Sentences = std::vector<std::string>;

/// Lost connections are reported from this number on.
constexpr std::size_t kDrops = 3;
constexpr Duration kRecently = 5min;
constexpr int kLastMinutes = 4;
/// Losses less than this time apart count as one restart of the server.
constexpr Duration kRestart = 10s;
/// A port that was closed for less than this time will probably open soon.
constexpr Duration kMoment = 15s;

/// Returns the finding that another service, such as a web server, answers in place of a device;
/// null: there is no such finding.
const Finding* OtherService(std::span<const bus::DeviceRecord> devices) {
  for (const bus::DeviceRecord& one : devices) {
    for (const Symptom symptom : {Symptom::other_protocol, Symptom::text}) {
      if (one.status.findings.Count(symptom) > 0) return &one.status.findings.Last(symptom);
    }
  }
  return nullptr;
}

std::string SayOtherService(const config::Line& line, std::span<const bus::DeviceRecord> devices) {
  const Finding* const other = OtherService(devices);
  if (other == nullptr || !line.is_network()) return {};
  const bool says = other->symptom == Symptom::text;
  return (says ? line.port + " sends " + other->cause
               : "no device is behind " + line.port + " (" + other->cause + ")") +
         NextSentence(other->remedy.empty() ? "check the port" : other->remedy);
}

/// Reports a server that closes the connection inside replies, if a device has never answered
/// because of this.
std::string SayEndsInside(const config::Line& line, std::span<const bus::DeviceRecord> devices) {
  const auto breaks_off = [](const bus::DeviceRecord& one) {
    return !one.status.last_ok && one.status.findings.Count(Symptom::tail_lost) >= kDrops;
  };
  if (!line.is_network() || !std::ranges::any_of(devices, breaks_off)) return {};
  return "the server closes the connection in the middle of replies. Check the server and the "
         "device behind it (firmware, limits)";
}

const char* WhyNoData(const config::SerialSettings& serial) {
  if (serial.rtscts) {
    return ", because it takes no data. Check that the CTS line of the device is connected and "
           "active";
  }
  if (serial.xonxoff) {
    return ", because XOFF came, and no XON after it. Switch XON/XOFF off at both ends";
  }
  return ", because it takes no data. Unplug the adapter and plug it in again, or restart the "
         "device behind it";
}

std::string Lost(const config::Line& line, const bus::LineStatus& status, std::size_t times,
                 std::span<const bus::DeviceRecord> devices, Instant now) {
  if (std::string other = SayOtherService(line, devices); !other.empty()) return other;
  if (std::string inside = SayEndsInside(line, devices); !inside.empty()) return inside;
  if (line.is_network()) {
    return fmt::format("the connection was lost {} in the last hour{}", Times(times),
                       NextSentence(WhyEnded(status, now - 1h, false)));
  }
  return fmt::format("the open port was lost {} in the last hour{}", Times(times),
                     status.takes_no_data ? WhyNoData(line.serial)
                                          : ". Check plug, hub and power; the log has the times");
}

/// Returns the number of losses in the last hour. Connections that end while a server restarts
/// count as one loss.
std::size_t LossesOf(const config::Line& line, const bus::LineStatus& status, Now now) {
  return status.losses.Since(now.instant - 1h, line.is_network() ? kRestart : Duration());
}

/// True if the losses are to be reported. At a server a few are normal: an update ends one or two
/// connections. To refuse or disappear twice in two minutes is a fault.
bool IsLostOften(const config::Line& line, const bus::LineStatus& status, std::size_t lost,
                 Now now) {
  if (!line.is_network()) return lost > 0;
  const auto twice = [&](const bus::RecentTimes& what) {
    return what.Since(now.instant - 2min, kRestart) >= kFacts;
  };
  return lost >= kDrops || twice(status.ends.refused) || twice(status.ends.unreachable);
}

std::string Dropped(const bus::LineStatus& status, Now now) {
  const std::size_t times = status.drops.Since(now.instant - kRecently);
  if (times < kDrops) return {};
  return fmt::format(
      "the server has ended the connection {} in the last minutes while it was in use{}",
      Times(times), NextSentence(WhyEnded(status, now.instant - kRecently, true)));
}

}  // namespace

std::string WhyEnded(const bus::LineStatus& status, Instant since, bool in_use) {
  constexpr std::size_t kTwice = 2;
  constexpr std::size_t kThrice = 3;
  const bus::ConnectionEnds& ends = status.ends;
  const std::size_t asked = ends.asked.Since(since);
  const std::size_t all = asked + ends.idle.Since(since);
  const auto mostly = [&](const bus::RecentTimes& what) {
    const std::size_t times = what.Since(since);
    return times >= kTwice && 2 * times >= all;
  };
  if (mostly(ends.shut)) {
    return "the next connection was closed at once: end the other client of the server, or raise "
           "its limit of connections";
  }
  if (mostly(ends.refused)) {
    return "the next connection was refused: check the power and the log of the server, and "
           "whether its modem has lost the link";
  }
  if (mostly(ends.unreachable)) {
    return "no host answered for a while: check the power of the server and the network (cable, "
           "switch, radio)";
  }
  // If connections ended at random, a request would be under way in a share `use` of the cases.
  // Here it was clearly more often.
  if (all >= kThrice &&
      static_cast<double>(asked) >= (status.use + 1) / 2 * static_cast<double>(all)) {
    return "a request was under way nearly each time: check load, log and firmware of the server";
  }
  if (ends.alike >= kThrice && ends.age > Duration()) {
    return fmt::format(
        "each connection lasted about {:.1f} s: raise the time limit of connections at the server, "
        "or end its other client",
        Seconds(ends.age));
  }
  if (in_use) {
    return "another client takes the connection (end that client, or raise the limit of "
           "connections), or a router or firewall in between ends it";
  }
  return "check other clients of the server, its limit of connections, its inactivity time and "
         "restarts, and the network";
}

std::string SayClosed(const config::Line& line, const bus::LineStatus& status,
                      std::span<const bus::DeviceRecord> devices, Now now) {
  if (status.port == bus::LineStatus::Port::released && status.lent_to_client) {
    return fmt::format(
        "{} until {}; meanwhile the points of the line are out of service. Run 'baudgate release "
        "{} --end' to take the port back",
        status.port_text, ClockText(status.released_until), line.name);
  }
  if (status.port == bus::LineStatus::Port::released) {
    return fmt::format(
        "released: the port is lent until {}. Run 'baudgate release {} --end' to take the port "
        "back",
        ClockText(status.released_until), line.name);
  }
  if (std::string other = SayOtherService(line, devices); !other.empty()) return other;
  if (std::string inside = SayEndsInside(line, devices); !inside.empty()) return inside;
  // The port is opened again and again because no device answers, so this cause is reported.
  const auto absent = [](const bus::DeviceRecord& one) { return IsAbsent(one.status); };
  if (status.silent && std::ranges::any_of(devices, absent)) {
    const Evidence evidence = GatherAbsent(status, devices, now);
    const auto judged = Judge(evidence);
    if (!judged.empty()) return "no device answers: " + judged.front()->say(evidence);
  }
  const Duration closed = now.wall - status.port_since;
  const std::size_t lost = LossesOf(line, status, now);
  const bool again = status.port_since != WallTime{} && closed < kMoment;
  // If no device has ever answered, the reason why the port is closed helps more than the number of
  // losses.
  const auto answered = [](const bus::DeviceRecord& one) { return one.status.last_ok.has_value(); };
  const bool worked = std::ranges::any_of(devices, answered);
  const bool often =
      line.is_network() ? worked && IsLostOften(line, status, lost, now) : lost >= kFacts;
  if (again && often) return Lost(line, status, lost, devices, now.instant);
  const std::string since =
      status.port_since == WallTime{} ? std::string() : " for " + FormatAge(closed);
  return fmt::format("port closed{}: {}", since,
                     status.port_text.empty() ? "not opened yet" : status.port_text);
}

Sentences AboutLosses(const config::Line& line, const bus::LineStatus& status,
                      std::span<const bus::DeviceRecord> devices, Now now) {
  Sentences found;
  const std::size_t lost = LossesOf(line, status, now);
  if (IsLostOften(line, status, lost, now)) {
    found.push_back(Lost(line, status, lost, devices, now.instant));
  }
  // If the server ends the connection in place of an answer of one device, or at some of its
  // requests, a sentence about this device reports it.
  const bool told = std::ranges::any_of(devices, [&](const bus::DeviceRecord& one) {
    if (!one.status.last_ok) return one.status.findings.Last(Symptom::silence).ended;
    return EndsAtRequests(one, Gather(status, one, devices, now));
  });
  if (std::string dropped = Dropped(status, now); lost < kDrops && !told && !dropped.empty()) {
    found.push_back(std::move(dropped));
  }
  return found;
}

std::string SayEndsEach(const bus::LineStatus& status, std::span<const bus::DeviceRecord> devices,
                        Now now) {
  constexpr std::uint64_t kMany = 8;
  if (status.rests < kMany || 2 * status.rests < status.exchanges) return {};
  bus::MinuteCounts tally;
  for (const bus::DeviceRecord& one : devices)
    tally += one.status.hour.Sum(now.instant, kLastMinutes);
  if (tally.missed + tally.failed < kDrops) return {};
  return fmt::format(
      "the server ends the connection after each answer, and {} polls were missed or failed. Set "
      "the server to keep the connection open (its inactivity time, its mode)",
      tally.missed + tally.failed);
}

}  // namespace baudgate::diagnosis
