// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/outputs/status/two_lines.h"

namespace baudgate::status {
namespace {

config::Device MakeDevice(const std::string& name, const std::string& address,
                          const std::string& protocol) {
  config::Device device;
  device.name = name;
  device.address = address;
  device.protocol = protocol;
  device.profile = "toy";
  for (const char* point : {"current", "voltage"}) {
    device.points.emplace_back().name = point;
    device.points.back().unit = "A";
    if (device.points.size() > 1) device.points.back().group = config::Group::slow;
  }
  return device;
}

}  // namespace

config::Config TwoLines() {
  config::Config config;
  config.name = "substation-7";
  config.lines.resize(2);
  config::Line& bay = config.lines[0];
  bay.name = "bay-1";
  bay.port = "/dev/ttyUSB0";
  bay.protocol = "spabus";
  bay.serial.data_bits = 7;
  bay.serial.parity = config::Parity::even;
  bay.devices = {MakeDevice("feeder-1", "1", "spabus"), MakeDevice("feeder-2", "2", "spabus")};
  bay.devices[0].unit = 11;
  config::Line& io = config.lines[1];
  io.name = "io";
  io.port = "/dev/ttyUSB1";
  io.protocol = "dcon";
  io.devices = {MakeDevice("ai-1", "0x0A", "dcon")};
  return config;
}

void SetOpen(bus::PointStore& store, std::uint32_t line, const std::string& text) {
  store.UpdateLine(line, [&](bus::LineStatus& status) {
    status.port = bus::LineStatus::Port::open;
    status.port_text = text;
    status.port_since = kNow.wall - 3h;
  });
}

void AddExchanges(bus::PointStore& store, std::uint32_t device, Outcome outcome,
                  std::uint32_t count, Now at, Duration round_trip) {
  const auto add = [&](auto& status) {
    status.exchanges += count;
    status.outcomes[static_cast<std::size_t>(outcome)] += count;
    for (std::uint32_t i = 0; ProvesLife(outcome) && i < count; ++i) {
      status.round_trips.Add(round_trip);
    }
  };
  store.UpdateStatus(device, [&](bus::DeviceStatus& status) {
    add(status);
    status.last_outcome = outcome;
    for (std::uint32_t i = 0; i < count; ++i) {
      status.recent.Add(outcome);
      status.findings.Add({.symptom = ProvesLife(outcome) ? Symptom::clean : Symptom::silence});
    }
    if (!ProvesLife(outcome)) return;
    status.last_ok = at.instant;
    status.last_ok_wall = at.wall;
    if (status.state == bus::DeviceState::never_seen) status.state = bus::DeviceState::online;
  });
  store.UpdateLine(store.LineIndex(*store.line(device)), add);
}

}  // namespace baudgate::status
