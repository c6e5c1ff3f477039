// Soak of the gateway as a service with devices, each a simulated device on a pty. Measures the
// time from its start to the first good value and to its end. Checks that memory, descriptors and
// files do not grow, neither during a run nor from one kill -9 to the next. `packaging/soak.sh
// service` prints the results. Environment: BAUDGATE_SOAK_SECONDS (length of the run that is
// watched), _KILLS, _DEVICES (14 at most), _DDS (1: with the DDS process).
// SPDX-License-Identifier: Apache-2.0
#include <signal.h>

#include <algorithm>
#include <cstdio>
#include <fstream>

#include "tests/soak/role.h"
#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

namespace fs = std::filesystem;
using soak::Now;
using soak::Number;

constexpr int kUnit = 1;
/// Growth below this limit is ignored, because malloc sometimes takes a little more.
constexpr std::size_t kMostGrowthKiB = 2048;
/// Closed client connections that the gateway has not noticed yet hold descriptors.
constexpr std::size_t kMostMoreDescriptors = 2;

std::size_t Entries(const fs::path& folder) {
  std::error_code error;
  std::size_t count = 0;
  for (fs::directory_iterator one(folder, error), end; !error && one != end; one.increment(error)) {
    ++count;
  }
  return count;
}

struct Held {
  std::size_t kib = 0;
  std::size_t dds_kib = 0;
  std::size_t descriptors = 0;
  std::size_t shared = 0;  ///< files in /dev/shm
};

std::size_t ResidentKiB(const std::string& process) {
  std::ifstream file("/proc/" + process + "/status");
  for (std::string word; file >> word;) {
    std::size_t kib = 0;
    if (word == "VmRSS:" && file >> kib) return kib;
  }
  return 0;
}

Held HeldBy(const Child& daemon) {
  const std::string id = std::to_string(daemon.id());
  Held held{ResidentKiB(id), 0, Entries("/proc/" + id + "/fd"), Entries("/dev/shm")};
  for (const auto& thread : fs::directory_iterator("/proc/" + id + "/task")) {
    std::ifstream children(thread.path() / "children");
    for (std::string child; children >> child;) {
      held.dds_kib += ResidentKiB(child);
      held.descriptors += Entries("/proc/" + child + "/fd");
    }
  }
  return held;
}

class ServiceSoak : public Station {
 protected:
  void StartTwins() {
    const struct {
      const char* protocol;
      const char* profile;
      const char* serial;
      int count;
    } kTwins[] = {{"spabus", "spaj140c", "38400 7E1", 5},
                  {"dcon", "owen-mv110-8a", "115200 8N1", 5},
                  {"set4tm", "set-4tm.03m", "115200 8O1", 2},
                  {"modbus_rtu", "generic-meter", "115200 8N1", 2}};
    yaml_ = Head(Number("DDS", 0) == 1);
    int unit = kUnit;
    for (const auto& kind : kTwins) {
      for (int i = 0; i < kind.count && twins_.size() < Number("DEVICES", 14); ++i, ++unit) {
        const std::string line = "line" + std::to_string(unit);
        twins_.push_back(StartTwin(line, kind.profile, "1"));
        yaml_ += Line(line, kind.protocol,
                      std::string("address: 1, profile: ") + kind.profile +
                          ", unit: " + std::to_string(unit) + ", poll: 500ms",
                      std::string("serial: ") + kind.serial);
      }
    }
    Write("baudgate.yaml", yaml_);
  }
  double StartService() {
    const Instant begin = Now();
    daemon_ = Start({"run", "-c", (directory() / "baudgate.yaml").string()});
    EXPECT_TRUE(Eventually([&] { return client_.Float(kUnit, 0).has_value(); }))
        << daemon_->Errors();
    return std::chrono::duration<double>(Now() - begin).count();
  }
  void Settle() {
    for (int unit = kUnit; unit < kUnit + static_cast<int>(twins_.size()); ++unit) {
      const auto answers = [&] {
        const auto state = client_.Register(unit, 9000);
        return state == 1 || state == 2;  // online, or degraded because the machine is busy
      };
      EXPECT_TRUE(Eventually(answers, 60s)) << unit;
    }
  }
  void ReadFor(Duration time) {
    for (const Instant end = Now() + time; Now() < end; std::this_thread::sleep_for(100ms)) {
      client_.Input(kUnit, 0, 10);
      ModbusClient(port()).Input(kUnit, 0, 10);
    }
  }
  void Kill() {
    daemon_->Signal(SIGKILL);
    EXPECT_EQ(daemon_->WaitForEnd(), 128 + SIGKILL);
  }

  std::vector<std::unique_ptr<Child>> twins_;
  std::unique_ptr<Child> daemon_;
  ModbusClient client_{port()};
  std::string yaml_;
};

TEST_F(ServiceSoak, ResourcesDoNotGrowInALongRunWithManyKills) {
  const auto seconds = std::chrono::seconds(Number("SECONDS", 6));
  const std::size_t kills = Number("KILLS", 3);
  StartTwins();
  const std::size_t shared_before = Entries("/dev/shm");
  std::vector<double> starts = {StartService()};
  Settle();
  ReadFor(seconds / 3);
  const Held first = HeldBy(*daemon_);
  ReadFor(seconds - seconds / 3);
  const Held last = HeldBy(*daemon_);
  Held young;
  Held old;
  for (std::size_t i = 0; i < kills; ++i) {
    Kill();
    starts.push_back(StartService());
    Settle();
    (i == 0 ? young : old) = HeldBy(*daemon_);
  }
  const Instant stop = Now();
  daemon_->Signal(SIGTERM);
  EXPECT_EQ(daemon_->WaitForEnd(), 0);
  const double stopped = std::chrono::duration<double>(Now() - stop).count();
  const std::size_t shared_after = Entries("/dev/shm");

  std::sort(starts.begin(), starts.end());
  std::printf(
      "%zu devices%s: start to first value %.3f s (median of %zu, longest %.3f s); stop %.3f s\n",
      twins_.size(), Number("DDS", 0) == 1 ? ", DDS" : "", starts[starts.size() / 2], starts.size(),
      starts.back(), stopped);
  std::printf("resident: gateway %zu KiB, %zu KiB after %lld s; DDS process %zu, %zu KiB\n",
              first.kib, last.kib, static_cast<long long>(seconds.count()), first.dds_kib,
              last.dds_kib);
  std::printf("after kill -9 number 1 and %zu: gateway %zu, %zu KiB; descriptors %zu, %zu\n", kills,
              young.kib, old.kib, young.descriptors, old.descriptors);
  std::printf("descriptors %zu, %zu at the end; /dev/shm %zu before, %zu, %zu, %zu after\n",
              first.descriptors, last.descriptors, shared_before, first.shared, last.shared,
              shared_after);
  EXPECT_LE(last.kib, first.kib + kMostGrowthKiB);
  EXPECT_LE(last.dds_kib, first.dds_kib + kMostGrowthKiB);
  EXPECT_LE(last.descriptors, first.descriptors + kMostMoreDescriptors);
  if (kills > 1) {
    EXPECT_LE(old.kib, young.kib + kMostGrowthKiB);
    EXPECT_LE(old.descriptors, young.descriptors + kMostMoreDescriptors);
  }
  if (Number("DDS", 0) == 0) return;  // files of other programs in /dev/shm do not count
  EXPECT_LE(old.shared, std::max(young.shared, first.shared));
  EXPECT_LE(shared_after, shared_before);
}

}  // namespace
}  // namespace baudgate::system_test
