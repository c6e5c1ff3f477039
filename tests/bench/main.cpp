// Runs the benchmarks: baudgate_bench
// [line|dead|modbus|routes|drive|delay|scale|cost|crowd|rivals|history|tag|harm]…, all of them
// without arguments.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/utsname.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <thread>

#include "config/catalog/modules.h"
#include "config/loader.h"
#include "gateway/base/log.h"
#include "tests/bench/bench.h"

namespace baudgate::bench {

double CpuSeconds(pid_t process) {
  std::ifstream file(fmt::format("/proc/{}/stat", process));
  std::string text;
  std::getline(file, text);
  text.erase(0, text.rfind(')') + 1);  // the process name may contain any characters
  std::istringstream words(text);
  std::string skipped;
  for (int i = 0; i < 11; ++i) words >> skipped;
  double user = 0;
  double system = 0;
  words >> user >> system;
  return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

double StatusOf(pid_t process, const std::string& key) {
  std::ifstream file(fmt::format("/proc/{}/status", process));
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(key + ":")) return std::stod(line.substr(key.size() + 1));
  }
  return 0;
}

double Percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const auto index = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  return values[index];
}

double Median(std::vector<double> values) { return Percentile(std::move(values), 0.5); }

std::string Scratch() {
  struct Directory {
    std::string path = (std::filesystem::temp_directory_path() / "baudgate-bench-XXXXXX").string();
    Directory() {
      if (mkdtemp(path.data()) == nullptr) std::abort();
    }
    ~Directory() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
  };
  static const Directory directory;
  return directory.path;
}

config::Config Load(const std::string& yaml, const config::Catalog& catalog) {
  config::Loaded loaded = config::LoadText(yaml, "bench", catalog);
  if (!loaded.ok()) {
    for (const config::Problem& problem : loaded.problems) {
      fmt::print(stderr, "{}\n", ToString(problem));
    }
    std::exit(3);
  }
  static int gateways = 0;
  loaded.config.state = Scratch() + "/state-" + std::to_string(++gateways);
  return std::move(loaded.config);
}

Totals Sum(const bus::PointStore& store) {
  Totals totals;
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    store.Read(device, [&](const bus::DeviceRecord& record) {
      totals.exchanges += record.status.exchanges;
      totals.failed += record.status.exchanges - record.status.Count(Outcome::ok);
      totals.missed += record.status.missed;
      for (const bus::PointRecord& point : record.points) totals.readings += point.seq;
    });
  }
  return totals;
}

const char* Verdict(bool reached) { return reached ? "reached" : "MISSED"; }

namespace {

void PrintMachine() {
  utsname kernel{};
  uname(&kernel);
  std::string model = "unknown processor";
  std::ifstream cpus("/proc/cpuinfo");
  for (std::string line; std::getline(cpus, line);) {
    if (line.starts_with("model name")) {
      model = line.substr(line.find(':') + 2);
      break;
    }
  }
  fmt::print("machine: {} x {}, kernel {}\n", std::thread::hardware_concurrency(), model,
             kernel.release);
}

}  // namespace
}  // namespace baudgate::bench

int main(int argc, char** argv) {
  using namespace baudgate;
  log::Begin(log::Level::error);
  const config::Modules modules = config::LoadModules();
  const std::string_view role = argc > 1 ? argv[1] : "";
  if (role == "be-delay-subscriber") return bench::BeDelaySubscriber(argc - 2, argv + 2);
  if (role == "be-delay-relay") return bench::BeDelayRelay(argc - 2, argv + 2);
  if (role == "be-scale-twins") return bench::BeScaleTwins(modules.catalog, argc - 2, argv + 2);
  if (role == "be-scale-subscriber") return bench::BeScaleSubscriber(argc - 2, argv + 2);
  if (role == "be-crowd-slaves") return bench::BeCrowdSlaves(modules.catalog, argc - 2, argv + 2);
  if (role == "be-crowd-gateway") {
    return bench::BeCrowdGateway(modules.catalog, argc - 2, argv + 2);
  }
  const auto wanted = [&](std::string_view part) {
    return argc == 1 ||
           std::any_of(argv + 1, argv + argc, [&](const char* arg) { return part == arg; });
  };
  bench::PrintMachine();
  if (wanted("line")) bench::RunLineUse(modules.catalog);
  if (wanted("dead")) bench::RunDeadDevices(modules.catalog);
  if (wanted("modbus")) bench::RunModbusRate();
  if (wanted("tls")) bench::RunTls();
  if (wanted("routes")) bench::RunRoutes(modules.catalog);
  if (wanted("drive")) bench::RunDrive(modules.catalog);
  if (wanted("delay")) bench::RunAddedDelay(modules.catalog, "/proc/self/exe");
  if (wanted("scale")) bench::RunScale(modules.catalog, "/proc/self/exe");
  if (wanted("cost")) bench::RunCostPerPoint();
  if (wanted("crowd")) bench::RunCrowd("/proc/self/exe");
  if (wanted("rivals")) bench::RunRivals();
  if (wanted("history")) bench::RunHistory();
  if (wanted("tag")) bench::RunTagDelay(modules.catalog);
  if (wanted("harm")) bench::RunDdsHarm("/proc/self/exe");
  return 0;
}
