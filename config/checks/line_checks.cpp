// SPDX-License-Identifier: Apache-2.0
#include "config/checks/line_checks.h"

#include <algorithm>
#include <cmath>

#include "config/checks/round.h"

namespace baudgate::config {
namespace {

// USB adapters hold bytes back for up to 16 ms, serial servers alike.
constexpr Duration kShortestWait = 20ms;

using Messages = std::vector<std::string>;

/// Only what somebody has written is judged; the protocol's own times are known to work.
Messages TimingMessages(const Timing& given, const Timing& fallback, const SerialSettings& serial) {
  Messages messages;
  const auto add = [&](std::string text) { messages.push_back("timing: " + std::move(text)); };
  const auto late = [&](std::string_view key, std::optional<Duration> time) {
    if (!time || *time >= kShortestWait) return;
    add(std::string(key) + " " + FormatDuration(*time) +
        " is shorter than USB adapters and serial servers may hold bytes back (16ms): good "
        "replies would be lost; write 20ms or more");
  };
  late("reply", given.reply);
  late("gap", given.gap);
  const Duration three = 3 * serial.CharacterTime();
  if (given.gap && *given.gap >= kShortestWait && *given.gap < three) {
    add("gap " + FormatDuration(*given.gap) + " is shorter than three characters at " +
        serial.ToString() + ": good replies would be cut in two; leave it out, or write " +
        FormatDuration(std::chrono::ceil<std::chrono::milliseconds>(three)) + " or more");
  }
  const Timing used = Resolve(given, fallback);
  if (given.ceiling && *given.ceiling < *used.ceiling) {
    add("ceiling " + FormatDuration(*given.ceiling) + " is shorter than reply " +
        FormatDuration(*used.reply) + " and gap " + FormatDuration(*used.gap) + " together; " +
        FormatDuration(*used.ceiling) + " is used");
  }
  if (given.drain && *used.drain < *used.gap) {
    add("drain " + FormatDuration(*used.drain) + " is shorter than gap " +
        FormatDuration(*used.gap) +
        ": the rest of a broken reply may meet the next request; write at least as much");
  }
  return messages;
}

SerialSettings SerialOf(const Line& line, const Device& device) {
  return device.serial.value_or(line.serial);
}

/// What is wrong with the line's times is said once, not once a device.
void CheckTimes(const Line& line, const Catalog& catalog, Problems& problems) {
  Messages known;
  if (const Protocol* own = catalog.FindProtocol(line.protocol)) {
    known = TimingMessages(line.timing, own->timing(line.serial), line.serial);
  }
  for (const std::string& message : known) {
    problems.Warning(line.mark, "line '" + line.name + "': " + message);
  }
  for (const Device& device : line.devices) {
    const Protocol* protocol = catalog.FindProtocol(device.protocol);
    if (!protocol) continue;
    const SerialSettings serial = SerialOf(line, device);
    for (const std::string& message :
         TimingMessages(Merge(device.timing, line.timing), protocol->timing(serial), serial)) {
      if (std::find(known.begin(), known.end(), message) != known.end()) continue;
      problems.Warning(device.mark, "device '" + device.name + "': " + message);
    }
  }
}

std::string InMilliseconds(Duration time) {
  return FormatDuration(std::chrono::ceil<std::chrono::milliseconds>(time));
}

/// All that have a period.
std::vector<Group> PolledGroups(const Device& device) {
  std::vector<Group> groups = {Group::fast, Group::slow, Group::daily};
  for (std::size_t i = 0; i < device.intervals.size(); ++i) groups.push_back(OwnGroup(i));
  return groups;
}

/// Devices that think before they answer only make it worse.
void CheckLoad(const Line& line, const Catalog& catalog, Problems& problems) {
  std::map<const Protocol*, std::unique_ptr<Bus>> buses;
  double fast = 0;
  double slow = 0;
  bool told = false;
  for (const Device& device : line.devices) {
    const Protocol* protocol = catalog.FindProtocol(device.protocol);
    if (!protocol || !device.enabled) continue;
    auto& bus = buses[protocol];
    if (!bus) bus = MakeBus(*protocol);
    for (const Group group : PolledGroups(device)) {
      const Duration period = PeriodOf(device, group);
      const Round round = RoundOf(group, line, device, *protocol, bus.get());
      (group >= Group::fast ? fast : slow) +=
          static_cast<double>(round.time.count()) / static_cast<double>(period.count());
      if (round.time <= period) continue;
      told = true;
      problems.Warning(device.mark,
                       "device '" + device.name +
                           "': " + (group >= Group::fast ? "poll" : std::string(Name(group))) +
                           " " + FormatDuration(period) + " is shorter than one round of its " +
                           std::string(Name(group)) + " points takes at " +
                           SerialOf(line, device).ToString() +
                           " (requests: " + std::to_string(round.requests) + ", time: at least " +
                           InMilliseconds(round.time) + "): periods will be missed");
    }
  }
  if (told || fast + slow <= 1) return;
  problems.Warning(line.mark, "line '" + line.name + "': its polls need at least " +
                                  std::to_string(std::lround((fast + slow) * 100)) +
                                  " % of the line's time: periods will be missed; lengthen " +
                                  (slow > fast ? "slow, or ask for fewer points"
                                               : "poll, or move points to the group slow"));
}

/// Whether it is probed with something that only this is answered so.
bool HasProof(const Device& device, const Protocol& protocol, Bus* bus) {
  const auto conversation = MakeConversation(protocol, device, bus);
  const auto probe = conversation->Ask({Task::Kind::probe, 0, kNoPoint, {}}, Instant{});
  return !probe || probe->is_proof();
}

void CheckOrder(const Line& line, const Catalog& catalog, Problems& problems) {
  std::map<const Protocol*, std::unique_ptr<Bus>> buses;
  for (const Device& device : line.devices) {
    const Protocol* protocol = catalog.FindProtocol(device.protocol);
    if (!protocol || !device.enabled || device.trust_order) continue;
    auto& bus = buses[protocol];
    if (!bus) bus = MakeBus(*protocol);
    if (HasProof(device, *protocol, bus.get())) continue;
    problems.Warning(
        device.mark,
        "device '" + device.name +
            "': its replies do not show which request they answer, so after a lost reply "
            "its values are in doubt for some exchanges, which take line time; " +
            (device.options.Has("identify") ? "set identify: true if it tells its name, "
                                            : "let its profile identify it, ") +
            "or trust_order: true where no serial server or radio can hold replies back");
  }
}

}  // namespace

void CheckLine(const Line& line, const Catalog& catalog, Problems& problems) {
  CheckTimes(line, catalog, problems);
  CheckLoad(line, catalog, problems);
  CheckOrder(line, catalog, problems);
}

}  // namespace baudgate::config
