// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/live/demo.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <asio/executor_work_guard.hpp>
#include <asio/io_context.hpp>
#include <asio/signal_set.hpp>
#include <asio/steady_timer.hpp>
#include <csignal>
#include <filesystem>
#include <iterator>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/log.h"
#include "gateway/base/shown.h"
#include "gateway/daemon/daemon.h"
#include "gateway/tools/cli/live/one_port.h"
#include "gateway/tools/cli/offline/make_line.h"
#include "gateway/tools/simulate/simulator.h"
#include "gateway/tools/terminal/live_table.h"

namespace baudgate::tools {
namespace {

constexpr std::uint16_t kPortsToTry = 10;
constexpr std::uint16_t kWebPort = 8502;
constexpr Duration kRefresh = 500ms;

/// Shipped profiles have fixed Modbus units, so that the examples in the documentation stay valid:
/// `mbpoll -a 1` reads the SPAJ 140 C. Other profiles get units from kFirstFreeUnit on.
struct FixedUnit {
  std::string_view profile;
  std::uint8_t unit;
};
constexpr FixedUnit kUnits[] = {
    {"spaj140c", 1},
    {"spau130c", 2},
    {"adam-4017plus", 11},
    {"adam-4018plus", 12},
    {"icpdas-i-7017", 13},
    {"icpdas-i-7024", 14},
    {"icpdas-i-7060", 15},
    {"icpdas-i-7080", 16},
    {"owen-mv110-2a", 17},
    {"owen-mv110-8a", 18},
    {"set-4tm.02", 21},
    {"set-4tm.03m", 22},
    {"generic-meter", 31},
    {"mitsubishi-fr-d700", 32},
    {"bar-code", 41},
    {"olimex-mod-rfid125", 42},
    {"weighing", 43},
    {"olimex-mod-rfid125-asked", 44},
    {"mt-sics", 51},
    {"scpi-instrument", 52},
    {"lauda-thermostat", 53},
    {"nmea-0183-weather", 54},
    {"owen-mv110-8a-telegrams", 55},
};
constexpr std::uint8_t kFirstFreeUnit = 101;

/// Replaces dots, which a profile name can contain and a device name cannot.
std::string DeviceName(std::string profile) {
  for (char& c : profile) {
    if (c == '.') c = '_';
  }
  return profile;
}

/// Returns all protocols. Those that carry Modbus frames (Protocol::carrier) come last.
std::vector<const protocols::Protocol*> ProtocolsOf(const config::Catalog& catalog) {
  std::vector<const protocols::Protocol*> protocols;
  for (const auto& [name, protocol] : catalog.protocols) protocols.push_back(protocol);
  std::stable_partition(protocols.begin(), protocols.end(),
                        [](const protocols::Protocol* one) { return !one->carrier; });
  return protocols;
}

/// Makes one device for each profile in the protocol's own folder, with addresses from 1 on.
/// Devices that can send unasked get separate lines.
std::vector<WantedLine> DemoLines(const protocols::Protocol& protocol,
                                  const std::filesystem::path& directory,
                                  const config::Catalog& catalog) {
  std::vector<WantedLine> lines;
  const std::string name(protocol.name);
  for (const config::ProfileFile& profile : catalog.Profiles(name)) {
    if (profile.protocol != name) continue;
    if (lines.empty() || protocol.unasked != nullptr) {
      WantedLine& line = lines.emplace_back();
      line.protocol = name;
      line.name = protocol.unasked != nullptr ? name + "-" + std::to_string(lines.size()) : name;
      line.port = (directory / line.name).string();
    }
    auto& devices = lines.back().devices;
    devices.push_back({.name = DeviceName(profile.name),
                       .profile = profile.name,
                       .address = std::to_string(devices.size() + 1)});
  }
  return lines;
}

/// Makes the configuration of the demo. If another demo uses the usual port, `port` is different
/// and becomes a part of the gateway's name, which is the key of its DDS samples.
Result<config::Config> DemoConfig(const config::Catalog& catalog,
                                  const std::filesystem::path& directory,
                                  const DemoOptions& options, std::uint16_t port,
                                  std::uint16_t web_port) {
  config::Config config;
  config.name = port == options.port ? "demo" : fmt::format("demo-{}", port);
  config.state = directory / "state";
  config.modbus.listen.emplace_back().port = port;
  config.web.on = true;
  config.web.listen.port = web_port;
  config.web.acknowledge = true;
  config.dds.domain = options.domain;
  std::uint8_t free_unit = kFirstFreeUnit;
  for (const protocols::Protocol* protocol : ProtocolsOf(catalog)) {
    for (const WantedLine& wanted : DemoLines(*protocol, directory, catalog)) {
      auto line = MakeLine(wanted, catalog);
      if (!line) return Error{line.error()};
      for (std::size_t i = 0; i < line->devices.size(); ++i) {
        const auto fixed =
            std::ranges::find(kUnits, wanted.devices[i].profile, &FixedUnit::profile);
        line->devices[i].unit = fixed != std::end(kUnits) ? fixed->unit : free_unit++;
      }
      config.lines.push_back(std::move(*line));
    }
  }
  return config;
}

std::vector<PointRow> Rows(const bus::PointStore& store) {
  std::vector<PointRow> rows;
  const Instant now = ReadClocks().instant;
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    store.Read(device, [&](const bus::DeviceRecord& record) {
      for (std::size_t i = 0; i < record.points.size(); ++i) {
        const config::Point& point = record.device->points[i];
        if (point.group != config::Group::fast) continue;
        rows.push_back({record.device->name, point.name,
                        config::ShownText(point, record.points[i].value), point.unit,
                        QualityAt(record, i, now), AgeAt(record, i, now), false,
                        point.access == config::Access::write});
      }
    });
  }
  return rows;
}

std::size_t DevicesAlive(const bus::PointStore& store) {
  std::size_t alive = 0;
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    store.Read(device, [&](const bus::DeviceRecord& record) {
      alive += Answers(record.status.state) ? 1 : 0;
    });
  }
  return alive;
}

std::string Hints(const config::Config& config, const DemoOptions& options) {
  const int port = config.modbus.listen.front().port;
  std::string text = "\nWhile this runs, in another terminal:\n";
  text += fmt::format("  mbpoll -m tcp -p {} -a 1 -0 -r 0 -c 4 -t 3:float -B -1 127.0.0.1\n", port);
  text += fmt::format("  baudgate watch --domain {}\n", options.domain);
  return text;
}

/// Runs the twins on a separate thread, because they represent devices outside the gateway.
class Twins {
 public:
  ~Twins() {
    io_.stop();
    if (thread_.joinable()) thread_.join();
  }
  Status Add(const config::Line& line, const config::Catalog& catalog) {
    SimulatorOptions options;
    options.link = line.port;
    auto simulator = SimulateLine(io_, line, catalog, std::move(options));
    if (!simulator) return Error{simulator.error()};
    simulators_.push_back(std::move(*simulator));
    return {};
  }
  void Start() {
    thread_ = std::thread([this] { io_.run(); });
  }

 private:
  asio::io_context io_{1};
  std::vector<std::unique_ptr<Simulator>> simulators_;
  std::thread thread_;
};

class LiveDemo {
 public:
  LiveDemo(const daemon::Daemon& daemon, std::string head, std::string tail, std::ostream& out)
      : daemon_(daemon), head_(std::move(head)), tail_(std::move(tail)), out_(out), screen_(out) {}

  void Run(asio::io_context& io) {
    io_ = &io;
    OnResize();
    Draw();
    io.run();
  }

 private:
  void Draw() {
    if (auto view = TerminalView(STDOUT_FILENO)) {
      const std::size_t height = view->height;
      const auto around = std::ranges::count(head_ + tail_, '\n');
      if (height > 0) view->height -= std::min(height - 1, static_cast<std::size_t>(around));
      screen_.Draw(head_ + RenderPoints(Rows(daemon_.store()), *view) + tail_, height);
    }
    if (!out_) io_->stop();  // the program that reads the output has closed it
    refresh_.emplace(*io_, kRefresh);
    refresh_->async_wait([this](const asio::error_code& error) {
      if (!error) Draw();
    });
  }
  void OnResize() {
    if (!resized_) resized_.emplace(*io_, SIGWINCH);
    resized_->async_wait([this](const asio::error_code& error, int) {
      if (error) return;
      Draw();
      OnResize();
    });
  }

  const daemon::Daemon& daemon_;
  const std::string head_;
  const std::string tail_;
  std::ostream& out_;
  LiveScreen screen_;
  asio::io_context* io_ = nullptr;
  std::optional<asio::steady_timer> refresh_;
  std::optional<asio::signal_set> resized_;
};

void Show(const daemon::Daemon& daemon, const DemoOptions& options, std::ostream& out) {
  asio::io_context io(1);
  asio::signal_set stop(io, SIGTERM, SIGINT, SIGHUP);
  stop.async_wait([&io](const asio::error_code&, int) { io.stop(); });
  asio::steady_timer end(io);
  if (options.seconds) {
    end.expires_after(*options.seconds);
    end.async_wait([&io](const asio::error_code&) { io.stop(); });
  }
  const std::string head = "web page http://" + daemon.config_at_start().web.Address() +
                           "/\nbaudgate demo: " + daemon.Summary() + "\n";
  const std::string tail = Hints(daemon.config_at_start(), options);
  if (LiveScreen::Possible(STDOUT_FILENO)) {
    log::SetLeast(log::Level::error);
    LiveDemo(daemon, head, tail, out).Run(io);
  } else {
    out << head << tail << std::flush;
    io.run();
  }
}

}  // namespace

int RunDemo(const DemoOptions& options, const config::Catalog& catalog, std::ostream& out,
            std::ostream& err) {
  // Without this, a closed output would end the process before the scratch directory is removed.
  signal(SIGPIPE, SIG_IGN);
  const ScratchDirectory scratch("demo");
  if (scratch.path().empty()) {
    err << "baudgate: no folder for the demo's ptys can be made; set TMPDIR to a writable folder\n";
    return 4;
  }
  std::uint16_t offset = 0;
  std::uint16_t web_offset = 0;
  while (offset < kPortsToTry && web_offset < kPortsToTry) {
    const auto port = static_cast<std::uint16_t>(options.port + offset);
    const auto web_port = static_cast<std::uint16_t>(kWebPort + web_offset);
    const auto config = DemoConfig(catalog, scratch.path(), options, port, web_port);
    if (!config) {
      err << "baudgate: " << config.error() << "\n";
      return 3;
    }
    Twins twins;
    for (const config::Line& line : config->lines) {
      if (const Status status = twins.Add(line, catalog); !status) {
        err << "baudgate: " << status.error() << "\n";
        return 4;
      }
    }
    daemon::Daemon daemon(*config, catalog);
    if (const Status status = daemon.Start(); !status) {
      err << "baudgate: " << status.error() << "\n";
      // The most likely reason is that another gateway uses the port, so the next port is tried.
      const bool page = status.error().starts_with("web:");
      ++(page ? web_offset : offset);
      err << "baudgate: trying port " << (page ? web_port : port) + 1 << " instead\n";
      continue;
    }
    twins.Start();
    Show(daemon, options, out);
    const std::size_t alive = DevicesAlive(daemon.store());
    const std::size_t devices = daemon.store().device_count();
    const std::vector<PointRow> rows = Rows(daemon.store());
    daemon.Stop();
    if (!LiveScreen::Possible(STDOUT_FILENO)) out << RenderPoints(rows, {}) << "\n";
    out << fmt::format("{} of {} devices were read\n", alive, devices);
    return alive == devices && devices > 0 ? 0 : 4;
  }
  return 4;
}

}  // namespace baudgate::tools
