// A gateway with a device that can be written, and a session on a thread, for the tests of MQTT.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "config/model/config.h"
#include "gateway/outputs/mqtt/session.h"

namespace baudgate::mqtt::testing {

inline config::Point PointNamed(const std::string& name, config::Type type, bool allowed,
                                const std::string& unit = {}) {
  config::Point point;
  point.name = name;
  point.type = type;
  point.unit = unit;
  point.access = allowed ? config::Access::read_write : config::Access::read;
  point.writing.allowed = allowed;
  return point;
}

/// Returns the gateway "gate" with the line "bay", and on it "feeder" with the points current (A),
/// setting (0 to 40), trip (must be selected) and text.
inline config::Config GatewayConfig(std::uint16_t port = 1883) {
  config::Device device;
  device.name = "feeder";
  device.points = {PointNamed("current", config::Type::float32, false, "A"),
                   PointNamed("setting", config::Type::float32, true),
                   PointNamed("trip", config::Type::boolean, true),
                   PointNamed("text", config::Type::string, false)};
  device.points[1].writing.min = 0;
  device.points[1].writing.max = 40;
  device.points[2].writing.select = true;
  config::Config config;
  config.name = "gate";
  config.mqtt.on = true;
  config.mqtt.brokers = {{{"127.0.0.1", port}, false}};
  config.mqtt.client = "baudgate-gate";
  config.mqtt.commands = true;
  config.lines.resize(1);
  config.lines[0].name = "bay";
  config.lines[0].devices = {device};
  return config;
}

/// A session on a thread of its own, with a short patience. It can be started again after Stop.
class RunningSession {
 public:
  ~RunningSession() { Stop(); }
  void Start(const config::Config& config, Session::Links links) {
    links.patience = 400ms;
    links.connected = [this](bool connected) { connected_ = connected; };
    session_ =
        std::make_unique<Session>(std::make_shared<const config::Config>(config), std::move(links));
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) session_->Round(false);
      session_->Round(true);
    });
  }
  void Stop() {
    if (!thread_.joinable()) return;
    thread_.request_stop();
    thread_.join();
  }
  bool connected() const { return connected_; }
  Session* operator->() const { return session_.get(); }

 private:
  std::atomic<bool> connected_ = false;
  std::unique_ptr<Session> session_;
  std::jthread thread_;
};

}  // namespace baudgate::mqtt::testing
