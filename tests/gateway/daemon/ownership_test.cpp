// Test that a reload frees the configurations and device data that it has replaced.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <set>
#include <sstream>
#include <vector>

#include "gateway/daemon/daemon.h"
#include "gateway/daemon/reloader.h"
#include "gateway/tools/cli/client/control_client.h"
#include "tests/support/toy_protocol.h"
#include "tests/support/virtual_line.h"

namespace baudgate::daemon {
namespace {

constexpr std::size_t kPoints = 50;

config::Line LineOf(const std::string& name, const std::string& device) {
  std::vector<std::string> points;
  for (std::size_t i = 0; i < kPoints; ++i) points.push_back(std::to_string(i));
  config::Line line = ToyLine({ToyDevice(device, "A", points)});
  line.name = name;
  line.port = "/dev/not-there";
  // Each device has an event rule, so the object that watches for events refers to the device.
  for (config::Device& its : line.devices) {
    its.point_events = true;
    its.points[0].events.emplace_back();
  }
  return line;
}

config::Config ConfigOf(std::size_t round) {
  config::Config config;
  config.name = "plant";
  config.modbus.enabled = false;
  config.dds.enabled = false;
  config.socket = std::filesystem::temp_directory_path() /
                  ("ownership_test_" + std::to_string(::getpid()) + ".sock");
  config.lines = {LineOf("stays", "a")};
  config.lines[0].devices[0].max_age = std::chrono::seconds(10 + round);
  if (round % 3 == 2) return config;
  config.lines.push_back(LineOf("goes", "b"));
  config.lines[1].port += std::to_string(round);
  return config;
}

class Ownership : public ::testing::Test {
 protected:
  Ownership() {
    catalog_.protocols["toy"] = &ToyProtocol();
    ReloadOptions reload;
    reload.file = "plant.yaml";
    reload.read = [this] { return std::to_string(round_); };
    reload.load = [this](const std::string&) { return LoadedText{ConfigOf(round_), {}}; };
    reload.notify = [](const std::string&) {};
    reload.summary = [] { return std::string(); };
    daemon_ = std::make_unique<Daemon>(ConfigOf(0), catalog_);
    daemon_->SetReload(std::move(reload));
    const Status started = daemon_->Start();
    EXPECT_TRUE(started) << started.error();
    Remember();
  }

  void Reload() {
    ++round_;
    nlohmann::ordered_json answer;
    std::ostringstream err;
    const std::string socket = daemon_->config_at_start().socket;
    ASSERT_EQ(tools::Ask(socket, {{"command", "reload"}}, answer, err), 0) << err.str() << answer;
    Remember();
  }

  void Remember() {
    const bus::PointStore& store = daemon_->store();
    for (std::uint32_t device = 0; device < store.device_count(); ++device) {
      const auto line = store.line(device);
      if (line && seen_.insert(line).second) ++count_;
    }
    std::erase_if(seen_, [](const auto& one) { return one.expired(); });
  }

  config::Catalog catalog_;
  std::size_t round_ = 0;
  std::unique_ptr<Daemon> daemon_;
  std::size_t count_ = 0;
  std::set<std::weak_ptr<const config::Line>, std::owner_less<>> seen_;
};

TEST_F(Ownership, ReplacedConfigurationsAreFreedAfterAReload) {
  for (int i = 0; i < 20; ++i) Reload();
  const std::size_t before = mallinfo2().uordblks;
  for (int i = 0; i < 99; ++i) Reload();
  const std::size_t after = mallinfo2().uordblks;
  EXPECT_EQ(daemon_->store().present_count(), 1U);
  EXPECT_EQ(count_, 200U);
  EXPECT_EQ(seen_.size(), 2U) << "of the line that stays: as it began, and as it is now";
  const auto grown = static_cast<double>(after) - static_cast<double>(before);
  RecordProperty("bytes_per_reload", static_cast<int>(grown / 99));
  std::cout << "bytes per reload: " << grown / 99 << '\n';
  EXPECT_LT(grown / 99, 10'000) << "a device with its points has some 45 KB";
}

}  // namespace
}  // namespace baudgate::daemon
