// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/point_feed.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <string_view>

#include "gateway/base/exit_code.h"
#include "gateway/base/shown.h"

namespace baudgate::tools {
namespace {

constexpr Duration kLookInterval = 1s;

}  // namespace

Listening::Listening(std::vector<std::string> interfaces, Open open, Find find)
    : interfaces_(std::move(interfaces)), open_(std::move(open)), find_(std::move(find)) {}

Status Listening::Start() {
  watched_.emplace(interfaces_, find_());
  return open_();
}

std::optional<std::string> Listening::Look(Instant now) {
  if (now < next_look_) return std::nullopt;
  next_look_ = now + kLookInterval;
  std::string told;
  if (!failure_) {
    const auto changed = watched_->Look(find_());
    if (!changed) return std::nullopt;
    told = *changed + "; ";
  }
  const Status status = Start();
  const auto before = std::exchange(failure_, std::nullopt);
  if (status) return told + "watch restarts";
  failure_ = status.error();
  if (before == failure_) return std::nullopt;
  return told + *failure_;
}

Status PointFeed::Open() {
  Close();
  mailbox_.TakeAll();  // the publishers of these samples may have ended meanwhile
  return MakeAnew(subscriber_, mailbox_, [this] {
    return dds::DdsSubscriber::Create({.participant = participant_}, Callbacks());
  });
}

/// The mailbox is closed first, because a thread of the subscriber may wait in Put.
void PointFeed::Close() {
  mailbox_.Close();
  refused_before_ = refused();
  subscriber_.reset();
  rejected_before_ += rejected_.exchange(0);
}

std::uint64_t PointFeed::refused() const {
  return refused_before_ + (subscriber_ ? subscriber_->counters().refused : 0);
}

dds::SubscriberCallbacks PointFeed::Callbacks() {
  return {.on_point =
              [this](const dds::PointSample& sample, const dds::Origin& origin) {
                mailbox_.Put(PointEvent{sample, origin, {}});
              },
          .on_point_gone =
              [this](const dds::PointSample& sample, dds::Gone gone) {
                mailbox_.Put(PointEvent{sample, {}, gone});
              },
          .on_device = {},
          .on_device_gone = {},
          .on_gateway =
              [this](const dds::GatewaySample& sample, const dds::Origin& origin) {
                mailbox_.Put(GatewayStart{sample, origin.writer.publisher});
              },
          .on_gateway_gone = {},
          .on_gateways = {},
          .on_publisher_left = [this](const dds::PublisherId& id) { mailbox_.Put(id); },
          .on_rejected = [this](std::uint64_t samples) { rejected_ = samples; }};
}

namespace {

/// The parameters of RunLineLoop, which prints a line for each item of `watch --events` and
/// `--alarms`.
struct LineLoop {
  const StopSignals& signals;
  std::optional<Duration> seconds;  ///< ends after this time; empty: no limit
  int mailbox = -1;                 ///< readable when `print` has something to print
  std::function<void()> print;
};

int MillisecondsUntil(Instant then) {
  const Duration left = std::max<Duration>(then - ReadClocks().instant, Duration::zero());
  return static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(left).count());
}

void RunLineLoop(const LineLoop& loop, Listening& listening, std::ostream& out, std::ostream& err) {
  const Instant end = loop.seconds ? ReadClocks().instant + *loop.seconds : Instant::max();
  for (Instant now = ReadClocks().instant; now < end; now = ReadClocks().instant) {
    if (const auto told = listening.Look(now)) err << "watch: " << *told << std::endl;
    pollfd waited[] = {{loop.signals.descriptor(), POLLIN, 0}, {loop.mailbox, POLLIN, 0}};
    ::poll(waited, 2, MillisecondsUntil(std::min(end, listening.next_look())));
    loop.print();
    out.flush();
    if ((waited[0].revents & POLLIN) != 0 || !out) return;
  }
}

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

/// Returns the name of a number in a published type (gateway/outputs/dds/published_types.h).
/// Returns the number itself as text if it is unknown, because a newer gateway has sent it.
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

/// `Unseen` selects events that were not printed yet, because a gateway that starts can publish
/// events again. It compares the event number, and also the time of reception, because the numbers
/// begin at 1 again if the gateway's file is new.
class Unseen {
 public:
  bool Take(const dds::EventSample& event) {
    Last& last = last_[{event.gateway, event.device}];
    if (event.seq <= last.seq && event.receive_time_ns <= last.received) return false;
    last = {event.seq, event.receive_time_ns};
    return true;
  }
  bool Take(const dds::AlarmSample&) { return true; }  // each change of an alarm is printed

 private:
  struct Last {
    std::uint64_t seq = 0;
    std::int64_t received = 0;
  };
  std::map<std::pair<std::string, std::string>, Last> last_;
};

}  // namespace

std::string JsonLine(const dds::EventSample& event) { return Dump(JsonOf(event)); }

std::string PlainLine(const dds::EventSample& event) {
  return Harmless(TimeText(event.device_time_ns) + "  " + event.gateway + "  " + event.device +
                  "  " + std::to_string(event.seq) + "  channel " + std::to_string(event.channel) +
                  "  code " + std::to_string(event.code) + "  " + event.text);
}

/// The keys are those of `baudgate alarms --json`: "raised", not "raised_time_ns".
std::string JsonLine(const dds::AlarmSample& alarm) {
  return Dump(JsonOf(alarm, [&alarm](std::string_view field, Json& line) {
    if (field == "state") {
      line["state"] = StateOf(alarm);
    } else if (field == "priority") {
      line["priority"] = PriorityOf(alarm);
    } else if (field == "raised_time_ns") {
      line["raised"] = TimeText(alarm.raised_time_ns);
    } else if (field == "changed_time_ns") {
      line["changed"] = TimeText(alarm.changed_time_ns);
    } else {
      return false;
    }
    return true;
  }));
}

std::string PlainLine(const dds::AlarmSample& alarm) {
  std::string line = TimeText(alarm.changed_time_ns) + "  " + alarm.gateway + "  " + alarm.line +
                     "." + alarm.device + "  " + std::to_string(alarm.seq) + "  " + StateOf(alarm) +
                     "  " + PriorityOf(alarm) + "  " + alarm.text;
  if (!alarm.acknowledged_by.empty()) line += "  by " + alarm.acknowledged_by;
  return Harmless(line);
}

int RunWatchEvents(const WatchOptions& options, std::ostream& out, std::ostream& err) {
  using Sample = std::variant<dds::EventSample, dds::AlarmSample>;
  // Must exist before the library's threads, which inherit the blocked signals.
  const StopSignals signals;
  Mailbox<Sample> mailbox;
  const auto put = [&](const auto& sample, const dds::Origin&) {
    if (Matches(sample, options)) mailbox.Put(sample);
  };
  dds::SubscriberCallbacks callbacks;
  if (options.events) callbacks.on_event = put;
  if (options.alarms) callbacks.on_alarm = put;
  std::unique_ptr<dds::DdsSubscriber> subscriber;
  Listening listening(options.interfaces, [&] {
    return MakeAnew(subscriber, mailbox, [&] {
      return dds::DdsSubscriber::Create({.participant = ParticipantOf(options)}, callbacks);
    });
  });
  if (const Status status = listening.Start(); !status) {
    err << "watch: " << status.error() << '\n';
    return kExitCanNot;
  }
  Unseen unseen;
  const auto show = [&](const auto& sample) {
    if (unseen.Take(sample)) out << (options.json ? JsonLine(sample) : PlainLine(sample)) << '\n';
  };
  const auto print = [&] {
    for (const Sample& sample : mailbox.TakeAll()) std::visit(show, sample);
  };
  RunLineLoop({signals, options.seconds, mailbox.descriptor(), print}, listening, out, err);
  mailbox.Close();
  return kExitDone;
}

}  // namespace baudgate::tools
