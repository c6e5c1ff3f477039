// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/simulate.h"

#include <fmt/format.h>

#include <asio/io_context.hpp>
#include <asio/signal_set.hpp>
#include <csignal>
#include <cstring>
#include <filesystem>

#include "config/copies.h"
#include "config/loader.h"
#include "config/model/network.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/text.h"
#include "gateway/base/whole_file.h"
#include "gateway/tools/cli/offline/check.h"
#include "gateway/tools/cli/offline/make_line.h"
#include "gateway/tools/simulate/simulator.h"
#include "gateway/tools/terminal/tables.h"

namespace baudgate::tools {

int RunSimulate(const SimulateOptions& options, const config::Catalog& catalog, std::ostream& out,
                std::ostream& err) {
  const auto line = MakeLine(
      {.protocol = options.protocol,
       .serial = options.serial,
       .devices = {{.profile = options.profile, .address = options.address, .set = options.set}}},
      catalog);
  if (!line) {
    err << "baudgate: " << line.error() << "\n";
    return 3;
  }
  const config::Device& device = line->devices.front();
  SimulatorOptions simulator_options;
  simulator_options.link = options.pty;
  simulator_options.think_time = options.think_time;
  simulator_options.faults = options.faults;
  simulator_options.events = options.events;
  if (!options.serial.empty()) simulator_options.pace = line->serial;
  simulator_options.strict = !options.serial.empty();

  asio::io_context io(1);
  auto simulator =
      Simulator::Create(io, *catalog.FindProtocol(device.protocol), {device}, simulator_options);
  if (!simulator) {
    err << "baudgate: " << simulator.error() << "\n";
    return 4;
  }
  out << device.title << " at address " << device.address << " answers on " << (*simulator)->path()
      << (options.serial.empty() ? "" : ", paced at " + line->serial.ToString()) << std::endl;
  asio::signal_set stop(io, SIGTERM, SIGINT, SIGHUP);
  stop.async_wait([&io](const asio::error_code&, int) { io.stop(); });
  io.run();
  for (const FaultCount& count : (*simulator)->fault_counts()) {
    out << "fault " << count.fault << " struck " << count.struck << " of " << count.exchanges
        << " exchanges\n";
  }
  if (options.events) {
    const auto [raised, lost] = (*simulator)->event_counts();
    out << "events raised " << raised << ", lost because the memory of the device was full " << lost
        << "\n";
  }
  return 0;
}

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kTrialHead = "# A trial of ";

/// The folder of the simulated devices' ports, for a configuration that `--write` has written. The
/// destructor removes the folder if it is empty.
class TrialFolder {
 public:
  Status Make(fs::path path) {
    path_ = std::move(path);
    std::error_code error;
    fs::create_directories(path_, error);
    if (error) return Error{"cannot make the folder " + path_.string() + ": " + error.message()};
    return {};
  }
  ~TrialFolder() {
    std::error_code not_empty;
    if (!path_.empty()) fs::remove(path_, not_empty);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

class Bench {
 public:
  Bench(const SimulateConfigOptions& options, const config::Catalog& catalog)
      : options_(options), catalog_(catalog) {}

  Status Build(const config::Config& config) {
    if (!options_.write.empty()) {
      fs::path folder = options_.ports;
      if (folder.empty()) folder = fs::path(options_.write).replace_extension(".ports");
      if (const Status made = folder_.Make(fs::absolute(folder)); !made) return made;
    }
    for (const config::Line& line : config.lines) {
      SimulatorOptions options;
      options.think_time = options_.think_time;
      options.faults = options_.faults;
      options.events = options_.events;
      if (const Status placed = Place(line, options); !placed) return placed;
      auto made = SimulateLine(io_, line, catalog_, std::move(options));
      if (!made) return Error{"line " + line.name + ": " + made.error() + Hint()};
      simulators_.push_back(std::move(*made));
    }
    return {};
  }

  std::vector<std::string> ports() const {
    std::vector<std::string> ports;
    for (const auto& one : simulators_) ports.push_back(one->path());
    return ports;
  }
  fs::path state() const { return folder_.path() / "state"; }

  void Run() {
    asio::signal_set stop(io_, SIGTERM, SIGINT, SIGHUP);
    stop.async_wait([this](const asio::error_code&, int) { io_.stop(); });
    io_.run();
  }

  void PrintLines(const config::Config& config, std::ostream& out) const {
    TextTable table({"line", "port", "serial", "devices"});
    for (std::size_t i = 0; i < simulators_.size(); ++i) {
      const config::Line& line = config.lines[i];
      std::string devices;
      for (const config::Device& device : line.devices) {
        devices += (devices.empty() ? "" : ", ") + device.name + " (" + device.address + ")";
      }
      table.Add({line.name, simulators_[i]->path(), line.tcp ? "" : line.serial.ToString(),
                 devices.empty() ? "none: no reply" : devices});
    }
    table.PrintAligned(out);
  }

  void PrintCounts(const config::Config& config, std::ostream& out) const {
    for (std::size_t i = 0; i < simulators_.size(); ++i) {
      const Simulator& one = *simulators_[i];
      out << "line " << config.lines[i].name << ": answered " << one.answered() << " requests\n";
      for (const FaultCount& count : one.fault_counts()) {
        out << "  fault " << count.fault << " struck " << count.struck << " of " << count.exchanges
            << " exchanges\n";
      }
    }
  }

 private:
  Status Place(const config::Line& line, SimulatorOptions& options) const {
    const bool trial = !options_.write.empty();
    if (!line.is_network()) {
      options.link = trial ? (folder_.path() / line.name).string() : line.port;
      return {};
    }
    const auto at = config::ParseHostPort(std::string_view(line.port).substr(6));
    if (trial || !at) {
      options.listen = config::HostPort{"127.0.0.1", 0};
      return {};
    }
    options.listen = *at;
    if (at->host == "localhost") options.listen->host = "127.0.0.1";
    const auto network = config::ParseNetwork(options.listen->host);
    if (network && config::IsLoopback(*network)) return {};
    return Error{"line " + line.name + ": " + line.port +
                 " is a port of another machine, which cannot be simulated here" + Hint()};
  }

  std::string Hint() const {
    if (!options_.write.empty()) return "";
    return "; `baudgate simulate -c " + options_.file +
           " --write TRIAL.yaml` writes the same configuration with simulated ports";
  }

  const SimulateConfigOptions& options_;
  const config::Catalog& catalog_;
  TrialFolder folder_;
  asio::io_context io_{1};
  std::vector<std::unique_ptr<Simulator>> simulators_;
};

/// Refuses to overwrite a file, except a file that `--write` has written before.
Status CheckTarget(const std::string& file, const std::string& original) {
  std::error_code error;
  if (fs::equivalent(file, original, error)) {
    return Error{file + " is the configuration itself; choose another name for --write"};
  }
  if (!fs::exists(file, error)) return {};
  const auto there = ReadWhole(file);
  if (there && there->starts_with(kTrialHead)) return {};
  return Error{file + " exists and was not written by --write; choose another name"};
}

Status WriteTrial(const SimulateConfigOptions& options, const std::string& text,
                  const config::Catalog& catalog, const Bench& bench, std::ostream& out) {
  const auto trial = config::MakeTrialConfig(
      text, {bench.ports(), fs::absolute(options.file).parent_path(), bench.state()});
  if (!trial) return Error{options.file + ": " + trial.error()};
  const config::Loaded again = config::LoadText(trial->yaml, options.write, catalog);
  if (!again.ok()) {
    for (const config::Problem& problem : again.problems) {
      if (!problem.warning) return Error{problem.mark.ToString() + ": " + problem.message};
    }
  }
  const std::string head =
      std::string(kTrialHead) + options.file +
      ": its ports lead to simulated devices, and its outputs listen on loopback only.\n";
  if (const int failed = WriteWhole(options.write, head + trial->yaml)) {
    return Error{options.write + " cannot be written: " + std::strerror(failed)};
  }
  for (const std::string& left_out : trial->left_out) out << "left out: " << left_out << '\n';
  out << "\nNow, in another terminal:\n  baudgate run -c " << options.write << '\n';
  return {};
}

int Fail(const std::string& message, std::ostream& err) {
  err << "baudgate: " << message << '\n';
  return kExitCanNot;
}

}  // namespace

int RunSimulateConfig(const SimulateConfigOptions& options, const config::Catalog& catalog,
                      std::ostream& out, std::ostream& err) {
  signal(SIGPIPE, SIG_IGN);  // without this, a client that disconnects could end the process
  const auto text = ReadWhole(options.file);
  const config::Loaded loaded = text ? config::LoadText(*text, options.file, catalog)
                                     : config::LoadFile(options.file, catalog);
  PrintProblems(loaded.problems, err);
  if (!loaded.ok() || !text) return kExitBadConfiguration;
  if (loaded.config.lines.empty()) {
    err << "baudgate: " << options.file << " has no lines, so there is no device to simulate\n";
    return kExitBadConfiguration;
  }
  if (!options.write.empty()) {
    if (const Status free = CheckTarget(options.write, options.file); !free)
      return Fail(free.error(), err);
  }
  Bench bench(options, catalog);
  if (const Status built = bench.Build(loaded.config); !built) return Fail(built.error(), err);
  bench.PrintLines(loaded.config, out);
  if (!options.write.empty()) {
    const Status written = WriteTrial(options, *text, catalog, bench, out);
    if (!written) return Fail(written.error(), err);
  }
  out << std::flush;
  bench.Run();
  bench.PrintCounts(loaded.config, out);
  return kExitDone;
}

}  // namespace baudgate::tools
