// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/watch.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "gateway/base/exit_code.h"
#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/tools/terminal/command_end.h"
#include "gateway/tools/terminal/words.h"
#include "gateway/tools/watch/point_feed.h"
#include "gateway/tools/watch/point_image.h"
#include "gateway/tools/watch/watch_lines.h"

namespace baudgate::tools {
namespace {

std::string NotAMachine(const std::string& address) {
  if (config::IsMachineIpv4(address)) return {};
  return Quoted(address) + " is not the IPv4 address of a machine; write for example 10.0.0.7";
}

}  // namespace

CLI::App* AddWatch(CLI::App& app, WatchOptions& options) {
  auto* command =
      app.add_subcommand("watch", "Show values, events and alarms that gateways publish on DDS");
  SetExample(*command, "baudgate watch --device feeder-1");
  command->add_option("--domain", options.domain, "DDS domain")->check(CLI::Range(0, 232));
  command->add_option("--interface", options.interfaces, "Addresses to listen on")
      ->capture_default_str();
  command->add_option("--security", options.security,
                      "Folder with ca.pem, identity.pem, key.pem, governance.p7s, permissions.p7s");
  command
      ->add_option("--peer", options.peers,
                   "Other machines (IPv4) to ask for gateways, besides multicast")
      ->check(CLI::Validator(NotAMachine, "IPV4"))
      ->expected(1, config::kMostPeers);
  command
      ->add_option_function<std::vector<std::string>>(
          "--discovery-server",
          [&options](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
              const auto server = config::ParseDiscoveryServer(text);
              if (!server) throw CLI::ValidationError("--discovery-server", server.error());
              if (const std::string wrong = NotAMachine(server->host); !wrong.empty()) {
                throw CLI::ValidationError("--discovery-server", wrong);
              }
              options.discovery_servers.push_back(*server);
            }
          },
          "Discovery servers (HOST:PORT) to ask for gateways, besides multicast")
      ->expected(1, config::kMostDiscoveryServers);
  command->add_flag_callback(
      "--no-multicast", [&options] { options.multicast = false; },
      "Look for gateways only at peers and discovery servers");
  auto* once = command->add_flag("--once", options.once, "Print the values once, then end");
  command->add_flag("--json", options.json, "Print one JSON object per line for each reading");
  AddSeconds(*command, options.seconds);
  command->add_option("--gateway", options.gateway, "Show this gateway only");
  command->add_option("--device", options.device, "Show this device only");
  auto* point = command->add_option("--point", options.point, "Show this point only");
  command->add_option("--point-order", options.point_order, "")->group("");  // hidden from users
  auto* events = command
                     ->add_flag("--events", options.events,
                                "Show events of devices: the newest events, then each new event")
                     ->excludes(once)
                     ->excludes(point);
  command
      ->add_flag("--alarms", options.alarms,
                 "Show alarms that are active or not acknowledged, then each change")
      ->excludes(once)
      ->excludes(events);
  return command;
}

namespace {

constexpr Duration kSettled = 300ms;
constexpr Duration kOthersOnly = 2s;
constexpr Duration kRedraw = 500ms;
constexpr std::size_t kMostAlarms = 5;

Instant Clock() { return std::chrono::steady_clock::now(); }

PointOrder OrderOf(const WatchOptions& options) {
  std::ifstream profiles(options.point_order);
  return profiles ? PointOrder(profiles) : PointOrder();
}

class Watch {
 public:
  Watch(const WatchOptions& options, std::ostream& out, std::ostream& err)
      : options_(options),
        out_(out),
        err_(err),
        image_(OrderOf(options)),
        feed_(ParticipantOf(options)),
        listening_(options.interfaces, [this] {
          publishers_.OnDeaf();
          return feed_.Open();
        }) {}

  int Run() {
    // Must exist before the library's threads, which inherit the blocked signals.
    const StopSignals signals(Live() ? StopSignals::And::resize : StopSignals::And::nothing);
    if (const Status status = listening_.Start(); !status) {
      err_ << "watch: " << status.error() << '\n';
      return kExitCanNot;
    }
    const int exit_code = Loop(signals);
    screen_.reset();
    feed_.Close();
    if (const std::uint64_t lost = feed_.rejected(); lost > 0) {
      err_ << "watch: " << lost
           << " samples were left out: there are too many points; watch a domain with fewer "
              "gateways\n";
    }
    if (const std::string refused = RefusedText(); !refused.empty()) {
      err_ << "watch: " << refused << '\n';
    }
    return exit_code;
  }

 private:
  int Loop(const StopSignals& signals) {
    started_ = Clock();
    if (Live()) screen_.emplace(out_);
    for (;;) {
      if (const auto told = listening_.Look(Clock())) Say(*told);
      pollfd waited[] = {{signals.descriptor(), POLLIN, 0}, {feed_.descriptor(), POLLIN, 0}};
      ::poll(waited, 2, PollTime());
      const Instant now = Clock();
      for (const HeardEvent& event : feed_.TakeAll()) {
        std::visit([&](const auto& it) { Take(it, now); }, event);
      }
      publishers_.Tick(now);
      for (const Remark& remark : publishers_.TakeRemarks()) Tell(remark);
      if (signals.Came()) return AtEnd();
      if ((waited[0].revents & POLLIN) != 0) next_draw_ = now;  // SIGWINCH: the size has changed
      if (options_.once) {
        if (!image_.empty() && now - last_new_ >= kSettled) return PrintImage();
        if (image_.empty() && now >= GiveUpAt()) return NothingHeard();
      }
      if (options_.seconds && now - started_ >= *options_.seconds) return AtEnd();
      if (Live() && now >= next_draw_) Draw(now);
      out_.flush();
      // If the program that reads the output has closed it, the command ends, as by SIGPIPE.
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

  void Take(const GatewayStart& start, Instant) {
    if (options_.gateway.empty() || options_.gateway == start.sample.gateway) {
      publishers_.OnStart(start.sample, start.publisher);
    }
  }

  void Take(const PointEvent& event, Instant now) {
    // A write-only point never has a value, so a table or text shows no row for it. JSON contains
    // all that is published.
    const bool never_read = event.sample.seq == 0 && image_.order().IsWriteOnly(event.sample.point);
    if (!options_.json && never_read) return;
    if (!Matches(event.sample)) {
      if (filtered_++ == 0) first_filtered_ = Clock();
      return;
    }
    if (!event.gone) publishers_.OnSample(event.sample, event.origin, now);
    const News news = image_.Put(event);
    if (news == News::point) last_new_ = Clock();
    const bool is_shown = news >= (options_.json ? News::reading : News::value);
    if (is_shown && !options_.once && !Live()) Print(event);
  }

  /// Prints a remark as a line. A note is printed only if points are printed as text lines. While a
  /// live table is shown, nothing is printed; the table shows alarms below its rows.
  void Tell(const Remark& remark) {
    const bool streams_text = !options_.once && !options_.json;
    if (remark.weight == Remark::Weight::note && !streams_text) return;
    Say(remark.text);
  }

  void Say(const std::string& text) {
    if (!Live()) err_ << Harmless("watch: " + text) << std::endl;
  }

  std::string RefusedText() const {
    const std::uint64_t refused = feed_.refused();
    if (refused == 0) return {};
    return std::to_string(refused) +
           " samples were left out: they are longer than the DDS types allow, or have an unknown "
           "encoding";
  }

  void Print(const PointEvent& event) {
    out_ << (options_.json ? JsonLine(event) : PlainLine(event)) << '\n';
  }

  int PrintImage() {
    if (options_.json) {
      for (const PointEvent* event : image_.Ordered()) Print(*event);
    } else {
      out_ << RenderPoints(image_.Rows(ReadClocks().wall),
                           options_.terminal
                               ? TableView{options_.terminal->width, 0, options_.terminal->colour}
                               : TableView{});
    }
    out_.flush();
    return kExitDone;
  }

  void Draw(Instant now) {
    next_draw_ = now + kRedraw;
    TableView view = *options_.terminal;
    // The terminal may have been resized since the last call.
    if (const auto current = TerminalView(STDOUT_FILENO)) view = *current;
    const std::size_t height = view.height;
    const std::string foot = Foot(view);
    const std::string text = image_.empty() ? "waiting for a gateway in DDS domain " +
                                                  std::to_string(options_.domain) + " on " +
                                                  Interfaces() + " ...\n"
                                            : RenderPoints(image_.Rows(ReadClocks().wall), view);
    screen_->Draw(text + foot, height);
  }

  /// Returns the lines below the table, and reduces `view.height` by their number.
  std::string Foot(TableView& view) const {
    std::vector<std::string> lines = publishers_.Alarms();
    if (lines.size() > kMostAlarms) lines.resize(kMostAlarms);
    if (const std::string refused = RefusedText(); !refused.empty()) lines.push_back(refused);
    if (listening_.failure()) lines.push_back(*listening_.failure());
    std::string text;
    for (const std::string& line : lines) {
      text +=
          (view.colour ? "\x1b[31m" : "") + Harmless(line) + (view.colour ? "\x1b[0m" : "") + "\n";
    }
    if (view.height > 0) view.height -= std::min(lines.size(), view.height - 1);
    return text;
  }

  /// Returns when `once` gives up. If samples have come but the filter has dropped all, the network
  /// works, so it gives up early; if no sample has come, it gives up late.
  Instant GiveUpAt() const {
    const Instant latest = started_ + options_.first_sample_timeout;
    return filtered_ > 0 ? std::min(latest, first_filtered_ + kOthersOnly) : latest;
  }

  int AtEnd() { return image_.empty() ? NothingHeard() : kExitDone; }

  int NothingHeard() {
    screen_.reset();
    if (filtered_ > 0) {
      err_ << "watch: " << filtered_
           << " samples came, but none of the requested gateway, device and point; check these "
              "names\n";
    } else {
      err_ << "watch: no samples came on domain " << options_.domain << " (" << Interfaces()
           << "); check that the gateway runs, that its dds.domain is " << options_.domain
           << " and that its dds.interfaces reach this machine\n";
    }
    return kExitCanNot;
  }

  std::string Interfaces() const {
    std::string text;
    for (const std::string& name : options_.interfaces) text += (text.empty() ? "" : ", ") + name;
    return text.empty() ? "all interfaces" : text;
  }

  /// Returns how many milliseconds the loop can wait for a new sample.
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

  const WatchOptions& options_;
  std::ostream& out_;
  std::ostream& err_;
  PointImage image_;
  Publishers publishers_;
  std::optional<LiveScreen> screen_;
  std::uint64_t filtered_ = 0;
  Instant first_filtered_{};
  Instant started_{};
  Instant last_new_{};
  Instant next_draw_{};
  PointFeed feed_;
  Listening listening_;
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
    err << "watch: --no-multicast needs --peer or --discovery-server\n";
    return kExitUsage;
  }
  if (options.events || options.alarms) return RunWatchEvents(options, out, err);
  return Watch(options, out, err).Run();
}

}  // namespace baudgate::tools
