// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/watch/watch.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <variant>

#include "gateway/base/exit_code.h"
#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/cli/terminal/live_screen.h"
#include "gateway/cli/terminal/stop_signals.h"
#include "gateway/dds/fast/subscriber.h"
#include "gateway/dds/watch/mailbox.h"
#include "gateway/dds/watch/point_order.h"
#include "gateway/dds/watch/publishers.h"
#include "gateway/dds/watch/watch_any.h"
#include "gateway/dds/watch/watch_events.h"
#include "gateway/dds/watch/watch_lines.h"

namespace baudgate {
namespace {

constexpr Duration kSettled = 300ms;
constexpr Duration kOthersOnly = 2s;
constexpr Duration kRedraw = 500ms;
constexpr std::size_t kMostAlarms = 5;

struct Started {
  dds::GatewaySample sample;
  dds::PublisherId publisher;
};
using Event = std::variant<PointEvent, Started, dds::PublisherId>;  ///< the last one has left

Instant Clock() { return std::chrono::steady_clock::now(); }

class Watch {
 public:
  Watch(const WatchOptions& options, std::ostream& out, std::ostream& err)
      : options_(options), out_(out), err_(err) {
    std::ifstream profiles(options.point_order);
    if (profiles) order_ = PointOrder(profiles);
  }

  int Run() {
    // Before the library's threads, which inherit the mask.
    const StopSignals signals(Live() ? StopSignals::And::resize : StopSignals::And::nothing);
    Mailbox<Event> mailbox;
    std::atomic<std::uint64_t> rejected = 0;
    auto subscriber = dds::DdsSubscriber::Create(
        {.participant = ParticipantOf(options_)},
        {.on_point =
             [&](const dds::PointSample& sample, const dds::Origin& origin) {
               mailbox.Put(PointEvent{sample, origin, {}});
             },
         .on_point_gone =
             [&](const dds::PointSample& sample, dds::Gone gone) {
               mailbox.Put(PointEvent{sample, {}, gone});
             },
         .on_device = {},
         .on_device_gone = {},
         .on_gateway =
             [&](const dds::GatewaySample& sample, const dds::Origin& origin) {
               mailbox.Put(Started{sample, origin.writer.publisher});
             },
         .on_gateway_gone = {},
         .on_gateways = {},
         .on_publisher_left = [&](const dds::PublisherId& id) { mailbox.Put(id); },
         .on_rejected = [&](std::uint64_t samples) { rejected = samples; }});
    if (!subscriber) {
      err_ << "watch: " << subscriber.error() << '\n';
      return kExitCanNot;
    }
    subscriber_ = subscriber->get();
    const int exit_code = Loop(signals, mailbox);
    screen_.reset();
    mailbox.Close();
    if (const std::uint64_t lost = rejected; lost > 0) {
      err_ << "watch: " << lost
           << " samples were left out: there are too many points to hold; watch "
           << "one domain with fewer gateways\n";
    }
    if (const std::string refused = RefusedText(); !refused.empty()) {
      err_ << "watch: " << refused << '\n';
    }
    return exit_code;
  }

 private:
  int Loop(const StopSignals& signals, Mailbox<Event>& mailbox) {
    started_ = Clock();
    if (Live()) screen_.emplace(out_);
    for (;;) {
      pollfd waited[] = {{signals.descriptor(), POLLIN, 0}, {mailbox.descriptor(), POLLIN, 0}};
      ::poll(waited, 2, PollTime());
      const Instant now = Clock();
      for (const Event& event : mailbox.TakeAll()) {
        std::visit([&](const auto& it) { Take(it, now); }, event);
      }
      publishers_.Tick(now);
      for (const Remark& remark : publishers_.TakeRemarks()) Tell(remark);
      if (signals.Came()) return AtEnd();
      if ((waited[0].revents & POLLIN) != 0) next_draw_ = now;  // another size
      if (options_.once) {
        if (!image_.empty() && now - last_new_ >= kSettled) return PrintImage();
        if (image_.empty() && now >= GiveUpAt()) return NothingHeard();
      }
      if (options_.seconds && now - started_ >= *options_.seconds) return AtEnd();
      if (Live() && now >= next_draw_) Draw(now);
      out_.flush();
      // A reader of our output that has left ends us, as SIGPIPE would.
      if (!out_) return kExitDone;
    }
  }

  bool Live() const { return options_.terminal && !options_.json && !options_.once; }

  bool Matches(const dds::PointSample& sample) const {
    const auto is = [](const std::string& filter, const std::string& name) {
      return filter.empty() || filter == name;
    };
    return is(options_.gateway, sample.gateway) && is(options_.device, sample.device) &&
           is(options_.point, sample.point);
  }

  void Take(const dds::PublisherId& left, Instant) { publishers_.OnLeft(left); }

  void Take(const Started& started, Instant) {
    if (options_.gateway.empty() || options_.gateway == started.sample.gateway) {
      publishers_.OnStart(started.sample, started.publisher);
    }
  }

  void Take(const PointEvent& event, Instant now) {
    // People need no row for what never has a value; programs get all that is published.
    const bool never_read = event.sample.seq == 0 && order_.IsWriteOnly(event.sample.point);
    if (!options_.json && never_read) return;
    if (!Matches(event.sample)) {
      if (filtered_++ == 0) first_filtered_ = Clock();
      return;
    }
    if (!event.gone) publishers_.OnSample(event.sample, event.origin, now);
    const Key key{event.sample.gateway, event.sample.device, event.sample.point};
    const auto before = image_.find(key);
    const bool news =
        before == image_.end() || (options_.json ? !IsSameReading(before->second, event)
                                                 : !LooksAlike(before->second, event));
    if (before == image_.end()) last_new_ = Clock();
    image_.insert_or_assign(key, event);
    if (news && !options_.once && !Live()) Print(event);
  }

  /// The live table has the alarms at its foot; who publishes is only news beside plain lines.
  void Tell(const Remark& remark) {
    if (Live()) return;
    const bool streams_text = !options_.once && !options_.json;
    if (remark.weight == Remark::Weight::note && !streams_text) return;
    err_ << Harmless("watch: " + remark.text) << std::endl;
  }

  std::string RefusedText() const {
    const std::uint64_t refused = subscriber_->counters().refused;
    if (refused == 0) return {};
    return std::to_string(refused) +
           " samples were left out: longer than the contract allows, or in an unknown encoding";
  }

  void Print(const PointEvent& event) {
    out_ << (options_.json ? JsonLine(event) : PlainLine(event)) << '\n';
  }

  int PrintImage() {
    if (options_.json) {
      for (const PointEvent* event : Ordered()) Print(*event);
    } else {
      out_ << RenderPoints(Rows(), options_.terminal ? TableView{options_.terminal->width, 0,
                                                                 options_.terminal->colour}
                                                     : TableView{});
    }
    out_.flush();
    return kExitDone;
  }

  /// By gateway and device, and the points of each as its profile has them.
  std::vector<const PointEvent*> Ordered() const {
    std::vector<const PointEvent*> ordered;
    for (auto first = image_.begin(); first != image_.end();) {
      const auto& [gateway, device, point] = first->first;
      std::vector<std::string> points;
      auto last = first;
      while (last != image_.end() && std::get<0>(last->first) == gateway &&
             std::get<1>(last->first) == device) {
        points.push_back(std::get<2>((last++)->first));
      }
      order_.Sort(points);
      for (const std::string& name : points) {
        ordered.push_back(&image_.at({gateway, device, name}));
      }
      first = last;
    }
    return ordered;
  }

  std::vector<PointRow> Rows() const {
    const WallTime now = ReadClocks().wall;
    const bool several = !image_.empty() &&
                         std::get<0>(image_.begin()->first) != std::get<0>(image_.rbegin()->first);
    std::vector<PointRow> rows;
    rows.reserve(image_.size());
    for (const PointEvent* event : Ordered()) {
      const dds::PointSample& sample = event->sample;
      PointRow row;
      row.device = several ? sample.gateway + "/" + sample.device : sample.device;
      row.point = sample.point;
      row.value = ValueText(sample);
      row.unit = sample.unit;
      row.quality = QualityOf(sample);
      if (sample.source_time_ns > 0) row.age = now - SourceTime(sample);
      row.gone = event->gone.has_value();
      rows.push_back(std::move(row));
    }
    return rows;
  }

  void Draw(Instant now) {
    next_draw_ = now + kRedraw;
    TableView view = *options_.terminal;
    // The window may have been resized since.
    if (const auto current = TerminalView(STDOUT_FILENO)) view = *current;
    const std::size_t height = view.height;
    const std::string foot = Foot(view);
    const std::string text = image_.empty() ? "waiting for a gateway in DDS domain " +
                                                  std::to_string(options_.domain) + " on " +
                                                  Interfaces() + " ...\n"
                                            : RenderPoints(Rows(), view);
    screen_->Draw(text + foot, height);
  }

  /// Takes its lines from the height of the table above.
  std::string Foot(TableView& view) const {
    std::vector<std::string> lines = publishers_.Alarms();
    if (lines.size() > kMostAlarms) lines.resize(kMostAlarms);
    if (const std::string refused = RefusedText(); !refused.empty()) lines.push_back(refused);
    std::string text;
    for (const std::string& line : lines) {
      text +=
          (view.colour ? "\x1b[31m" : "") + Harmless(line) + (view.colour ? "\x1b[0m" : "") + "\n";
    }
    if (view.height > 0) view.height -= std::min(lines.size(), view.height - 1);
    return text;
  }

  /// With `once`: wait longer in silence than after hearing others, who show that the way is good.
  Instant GiveUpAt() const {
    const Instant latest = started_ + options_.first_sample_timeout;
    return filtered_ > 0 ? std::min(latest, first_filtered_ + kOthersOnly) : latest;
  }

  int AtEnd() { return image_.empty() ? NothingHeard() : kExitDone; }

  int NothingHeard() {
    screen_.reset();
    if (filtered_ > 0) {
      err_ << "watch: " << filtered_ << " samples came, but none of the gateway, device and point "
           << "asked for; check those names\n";
    } else {
      err_ << "watch: nothing came on domain " << options_.domain << " (" << Interfaces()
           << "); check that the gateway runs, that its dds.domain is " << options_.domain
           << " and that its dds.interfaces reach this address\n";
    }
    return kExitCanNot;
  }

  std::string Interfaces() const {
    std::string text;
    for (const std::string& name : options_.interfaces) text += (text.empty() ? "" : ", ") + name;
    return text.empty() ? "all interfaces" : text;
  }

  /// Milliseconds until something is to be done without a new sample.
  int PollTime() const {
    const Instant now = Clock();
    Instant until = now + kRedraw;
    if (options_.once) {
      until = std::min(until, image_.empty() ? GiveUpAt() : last_new_ + kSettled);
    }
    if (options_.seconds) until = std::min(until, started_ + *options_.seconds);
    if (Live()) until = std::min(until, next_draw_);
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - now);
    return static_cast<int>(std::max<std::int64_t>(0, left.count()));
  }

  using Key = std::tuple<std::string, std::string, std::string>;

  const WatchOptions& options_;
  std::ostream& out_;
  std::ostream& err_;
  PointOrder order_;
  std::map<Key, PointEvent> image_;
  Publishers publishers_;
  std::optional<LiveScreen> screen_;
  const dds::DdsSubscriber* subscriber_ = nullptr;
  std::uint64_t filtered_ = 0;
  Instant first_filtered_{};
  Instant started_{};
  Instant last_new_{};
  Instant next_draw_{};
};

}  // namespace

dds::ParticipantOptions ParticipantOf(const WatchOptions& options) {
  dds::ParticipantOptions participant;
  participant.domain = options.domain;
  participant.interfaces = options.interfaces;
  if (!options.security.empty()) participant.security = config::SecurityIn(options.security);
  participant.peers = options.peers;
  participant.discovery_servers = options.discovery_servers;
  participant.multicast = options.multicast;
  return participant;
}

int RunWatch(const WatchOptions& options, std::ostream& out, std::ostream& err) {
  if (!options.multicast && options.peers.empty() && options.discovery_servers.empty()) {
    err << "watch: --no-multicast without --peer and --discovery-server asks nobody; name one of "
           "them\n";
    return kExitUsage;
  }
  if (options.events || options.alarms) return RunWatchEvents(options, out, err);
  return options.any ? RunWatchAny(options, out, err) : Watch(options, out, err).Run();
}

}  // namespace baudgate
