// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/watch/watch_events.h"

#include <poll.h>

#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "gateway/base/exit_code.h"
#include "gateway/base/shown.h"
#include "gateway/base/time.h"
#include "gateway/cli/terminal/stop_signals.h"
#include "gateway/dds/watch/mailbox.h"
#include "gateway/dds/watch/time_left.h"

namespace baudgate {
namespace {

std::string TimeText(std::int64_t since_1970) {
  return FormatWallTime(WallTime(Duration(since_1970)));
}

bool Is(const std::string& filter, const std::string& name) {
  return filter.empty() || filter == name;
}

bool Matches(const dds::EventSample& event, const WatchOptions& options) {
  return Is(options.gateway, event.gateway) && Is(options.device, event.device);
}

bool Matches(const dds::AlarmSample& alarm, const WatchOptions& options) {
  return Is(options.gateway, alarm.gateway) && Is(options.device, alarm.device) &&
         Is(options.point, alarm.point);
}

/// The numbers of the contract; one of a newer gateway has none.
std::string NameOf(std::span<const std::string_view> names, std::uint16_t number) {
  return number < names.size() ? std::string(names[number]) : std::to_string(number);
}

std::string StateOf(const dds::AlarmSample& alarm) {
  static constexpr std::array<std::string_view, 4> kNames = {"normal", "active", "acknowledged",
                                                             "returned"};
  return NameOf(kNames, alarm.state);
}

std::string PriorityOf(const dds::AlarmSample& alarm) {
  static constexpr std::array<std::string_view, 4> kNames = {"none", "low", "medium", "high"};
  return NameOf(kNames, alarm.priority);
}

std::string Dump(const nlohmann::ordered_json& line) {
  return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

/// Which events were not printed yet: a gateway that starts may publish some once more. By the
/// number, which counts anew where the gateway's file is a new one.
class Unseen {
 public:
  bool Take(const dds::EventSample& event) {
    Last& last = last_[{event.gateway, event.device}];
    if (event.seq <= last.seq && event.receive_time_ns <= last.received) return false;
    last = {event.seq, event.receive_time_ns};
    return true;
  }
  bool Take(const dds::AlarmSample&) { return true; }  // a state, not something that happens

 private:
  struct Last {
    std::uint64_t seq = 0;
    std::int64_t received = 0;
  };
  std::map<std::pair<std::string, std::string>, Last> last_;
};

}  // namespace

std::string JsonLine(const dds::EventSample& event) {
  nlohmann::ordered_json line;
  line["gateway"] = event.gateway;
  line["device"] = event.device;
  line["seq"] = event.seq;
  line["receive_time"] = TimeText(event.receive_time_ns);
  line["device_time"] = TimeText(event.device_time_ns);
  line["clock_quality"] = event.clock_quality;
  line["channel"] = event.channel;
  line["code"] = event.code;
  line["text"] = event.text;
  return Dump(line);
}

std::string PlainLine(const dds::EventSample& event) {
  return Harmless(TimeText(event.device_time_ns) + "  " + event.gateway + "  " + event.device +
                  "  " + std::to_string(event.seq) + "  channel " + std::to_string(event.channel) +
                  "  code " + std::to_string(event.code) + "  " + event.text);
}

std::string JsonLine(const dds::AlarmSample& alarm) {
  nlohmann::ordered_json line;
  line["gateway"] = alarm.gateway;
  line["seq"] = alarm.seq;
  line["state"] = StateOf(alarm);
  line["priority"] = PriorityOf(alarm);
  line["line"] = alarm.line;
  line["device"] = alarm.device;
  line["point"] = alarm.point;
  line["name"] = alarm.name;
  line["raised"] = TimeText(alarm.raised_time_ns);
  line["changed"] = TimeText(alarm.changed_time_ns);
  line["text"] = alarm.text;
  line["acknowledged_by"] = alarm.acknowledged_by;
  return Dump(line);
}

std::string PlainLine(const dds::AlarmSample& alarm) {
  std::string line = TimeText(alarm.changed_time_ns) + "  " + alarm.gateway + "  " + alarm.line +
                     "." + alarm.device + "  " + std::to_string(alarm.seq) + "  " + StateOf(alarm) +
                     "  " + PriorityOf(alarm) + "  " + alarm.text;
  if (!alarm.acknowledged_by.empty()) line += "  by " + alarm.acknowledged_by;
  return Harmless(line);
}

int RunWatchEvents(const WatchOptions& options, std::ostream& out, std::ostream& err) {
  const StopSignals signals;  // before the library's threads, which inherit the mask
  Mailbox<std::string> mailbox;
  Unseen unseen;  // of the subscriber's thread
  const auto put = [&](const auto& sample, const dds::Origin&) {
    if (!Matches(sample, options) || !unseen.Take(sample)) return;
    mailbox.Put(options.json ? JsonLine(sample) : PlainLine(sample));
  };
  dds::SubscriberCallbacks callbacks;
  if (options.events) callbacks.on_event = put;
  if (options.alarms) callbacks.on_alarm = put;
  const auto subscriber =
      dds::DdsSubscriber::Create({.participant = ParticipantOf(options)}, std::move(callbacks));
  if (!subscriber) {
    err << "watch: " << subscriber.error() << '\n';
    return kExitCanNot;
  }
  std::optional<Instant> until;
  if (options.seconds) until = ReadClocks().instant + *options.seconds;
  while (!until || ReadClocks().instant < *until) {
    pollfd waited[] = {{signals.descriptor(), POLLIN, 0}, {mailbox.descriptor(), POLLIN, 0}};
    ::poll(waited, 2, MillisecondsLeft(until));
    for (const std::string& line : mailbox.TakeAll()) out << line << '\n';
    out.flush();
    if ((waited[0].revents & POLLIN) != 0 || !out) break;
  }
  mailbox.Close();
  return kExitDone;
}

}  // namespace baudgate
