// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/manual_settings.h"

namespace baudgate {

ManualSettings ManualSettingsOf(const PointStore& store, std::uint32_t line,
                                const config::Line& config) {
  ManualSettings settings;
  const LineStatus status = store.ReadLine(line);
  // A client over the network has gone with the line.
  const bool by_hand = status.port == LineStatus::Port::released && !status.lent_to_client;
  settings.released_until = by_hand ? status.released_until : status.release_asked_until;
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    if (store.gone(device) || store.line(device).name != config.name) continue;
    bool in_use = true;
    store.Read(device, [&in_use](const DeviceRecord& record) {
      in_use = record.status.state != DeviceState::disabled;
    });
    const config::Device& its = store.device(device);
    if (in_use != its.enabled) settings.in_use.emplace(its.name, in_use);
  }
  return settings;
}

void Restore(const ManualSettings& before, LineControl& lines, const config::Line& config,
             std::uint32_t line, std::uint32_t first_device, WallTime now) {
  if (before.released_until > now) {
    lines.Release(line, std::chrono::ceil<std::chrono::seconds>(before.released_until - now));
  }
  const std::vector<config::Device>& devices = config.devices;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    const auto set = before.in_use.find(devices[i].name);
    if (set == before.in_use.end() || set->second == devices[i].enabled) continue;
    lines.SetInUse(first_device + static_cast<std::uint32_t>(i), set->second);
  }
}

}  // namespace baudgate
