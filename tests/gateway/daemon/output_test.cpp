// Test of an additional output, which needs only the interface and one row in a list.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/output.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <sstream>
#include <string_view>
#include <thread>

#include "gateway/daemon/daemon.h"
#include "gateway/daemon/reloader.h"
#include "gateway/tools/cli/client/control_client.h"
#include "tests/support/toy_protocol.h"
#include "tests/support/virtual_line.h"

namespace baudgate::daemon {
namespace {

using testing::ElementsAre;

/// Records what a RememberingOutput has received. Must outlive the output.
struct Seen {
  template <typename Change>
  void Note(Change change) {
    const std::lock_guard lock(mutex);
    change();
    changed.notify_all();
  }
  template <typename Holds>
  bool Wait(Holds holds) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, std::chrono::seconds(10), holds);
  }

  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> samples;  // Example: "a p0 8" is device, point, quality
  std::size_t devices = 0;
  std::vector<std::string> calls;
};

class RememberingOutput final : public outputs::Output {
 public:
  RememberingOutput(bus::PointStore& store, Seen& seen)
      : store_(store), seen_(seen), feed_(store.Subscribe()) {}
  ~RememberingOutput() override { RememberingOutput::Stop(); }

  std::string_view name() const override { return "test"; }
  Status Open(const Configuration& config) override {
    Count(*config, "open");
    return {};
  }
  Status Begin(const Configuration&) override {
    thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
    return {};
  }
  std::vector<std::string> Apply(const Configuration& config, std::unique_ptr<Prepared>) override {
    Count(*config, "apply");
    feed_->Wake();
    return {};
  }
  void StopRequests() override { Call("stop requests"); }
  void Stop() override {
    if (!thread_.joinable()) return;
    thread_.request_stop();
    feed_->Wake();
    thread_.join();
    Call("stop");
  }
  std::optional<Json> Section(const Wish&) const override {
    const std::lock_guard lock(seen_.mutex);
    return Json{{"samples", seen_.samples.size()}};
  }

 private:
  void Call(const char* what) {
    seen_.Note([&] { seen_.calls.emplace_back(what); });
  }
  void Count(const config::Config& config, const char* what) {
    std::size_t devices = 0;
    for (const config::Line& line : config.lines) devices += line.devices.size();
    seen_.Note([&] { seen_.devices = devices; });
    Call(what);
  }
  void Run(const std::stop_token& stop) {
    std::uint32_t known = 0;
    bus::Changes changes;
    while (!stop.stop_requested()) {
      for (; known < store_.device_count(); ++known) Take(known);
      feed_->Drain(ReadClocks().instant + 1s, changes);
      for (const bus::PointRef& at : changes.points) Take(at.device);
    }
  }
  void Take(std::uint32_t device) {
    store_.Read(device, [&](const bus::DeviceRecord& record) {
      for (std::size_t point = 0; point < record.points.size(); ++point) {
        const Quality quality = QualityAt(record, point, ReadClocks().instant);
        std::string sample = record.device->name + " " + record.device->points[point].name + " " +
                             std::to_string(quality.word());
        seen_.Note([&] { seen_.samples.push_back(std::move(sample)); });
      }
    });
  }

  bus::PointStore& store_;
  Seen& seen_;
  const std::shared_ptr<bus::ChangeFeed> feed_;
  std::jthread thread_;
};

/// Makes lines whose ports do not exist, so their points are bad.
config::Config WithLines(int count) {
  config::Config config;
  config.name = "plant";
  config.modbus.enabled = false;
  config.dds.enabled = false;
  config.socket = std::filesystem::temp_directory_path() /
                  ("output_test_" + std::to_string(::getpid()) + ".sock");
  for (int i = 0; i < count; ++i) {
    config.lines.push_back(ToyLine({ToyDevice(i == 0 ? "a" : "b", "A", {"1"})}));
    config.lines.back().name = "line-" + std::to_string(i);
    config.lines.back().port = "/dev/not-there-" + std::to_string(i);
  }
  return config;
}

TEST(Output, AddedToTheDaemonIsOpenedReloadedAndStopped) {
  config::Catalog catalog;
  catalog.protocols["toy"] = &ToyProtocol();
  Seen seen;
  Daemon daemon(WithLines(1), catalog);
  daemon.Add({[&](const OutputLinks& links) {
    return std::make_unique<RememberingOutput>(links.store, seen);
  }});
  ReloadOptions reload;
  reload.file = "plant.yaml";
  reload.read = [] { return std::string("with a second line"); };
  reload.load = [](const std::string&) { return LoadedText{WithLines(2), {}}; };
  reload.notify = [](const std::string&) {};
  reload.summary = [] { return std::string(); };
  daemon.SetReload(std::move(reload));
  const Status started = daemon.Start();
  ASSERT_TRUE(started) << started.error();
  const auto names = daemon.outputs();
  const auto place = [&](std::string_view name) { return std::ranges::find(names, name); };
  for (const char* writer : {"control", "web", "modbus"}) {
    EXPECT_LT(place(writer), place("dds")) << "they stop in this order";
  }
  EXPECT_LT(place("dds"), place("test"));
  EXPECT_EQ(names.back(), "test") << "an output that is added is the last";
  const auto has = [&](const std::string& device) {
    return std::ranges::any_of(
        seen.samples, [&](const std::string& sample) { return sample.starts_with(device + " "); });
  };
  EXPECT_TRUE(seen.Wait([&] { return has("a"); }));
  nlohmann::ordered_json status;
  std::ostringstream err;
  EXPECT_EQ(tools::Ask(daemon.config_at_start().socket, {{"command", "status"}}, status, err), 0)
      << err.str();
  EXPECT_GT(status["test"]["samples"], 0) << status;
  daemon.Reload("a test");
  EXPECT_TRUE(seen.Wait([&] { return seen.devices == 2 && has("b"); }));
  EXPECT_TRUE(daemon.Stop());
  EXPECT_THAT(seen.calls, ElementsAre("open", "apply", "stop requests", "stop"));
}

}  // namespace
}  // namespace baudgate::daemon
