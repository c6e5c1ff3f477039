// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/roster.h"

#include <algorithm>
#include <utility>

namespace baudgate {
namespace {

/// Slaves need time to carry out what none of them answers. MODBUS over Serial Line 1.02, 2.4.1:
/// 100 to 200 ms.
constexpr Duration kTurnaround = 100ms;

/// `given` over the protocol's own times for these settings.
LineTimes TimesOf(const config::Timing& given, const Protocol& protocol,
                  const config::SerialSettings& serial) {
  const config::Timing timing = config::Resolve(given, protocol.timing(serial));
  return {.quiet = *timing.quiet,
          .reply = *timing.reply,
          .gap = *timing.gap,
          .ceiling = *timing.ceiling,
          .drain = *timing.drain,
          .settle = {},
          .character = serial.CharacterTime()};
}

}  // namespace

void Device::LearnTimes() {
  const config::Timing least = conversation->LeastTimes(configured.character);
  const auto longer = [](Duration given, const std::optional<Duration>& learned) {
    return std::max(given, learned.value_or(Duration::zero()));
  };
  times.quiet = longer(configured.quiet, least.quiet);
  times.reply = longer(configured.reply, least.reply);
  times.gap = longer(configured.gap, least.gap);
  times.drain = longer(configured.drain, least.drain);
  times.ceiling = longer(configured.ceiling + times.reply - configured.reply, least.ceiling);
}

Roster::Roster(const config::Line& line, std::uint32_t first_device, const FindProtocol& find)
    : line_(line), first_device_(first_device) {
  const Protocol& own = find(line.protocol);
  if (own.carrier != nullptr) carrier_ = &own;
  std::vector<std::pair<const Protocol*, Bus*>> made;
  for (const config::Device& config : line.devices) {
    const Protocol& protocol = find(config.protocol);
    auto known = std::ranges::find(made, &protocol, [](const auto& pair) { return pair.first; });
    if (known == made.end()) {
      buses_.push_back(MakeBus(protocol));
      known = made.insert(made.end(), {&protocol, buses_.back().get()});
    }
    AddDevice(config, protocol, known->second);
  }
}

void Roster::AddDevice(const config::Device& config, const Protocol& protocol, Bus* bus) {
  auto device = std::make_unique<Device>();
  device->place = devices_.size();
  device->index = first_device_ + static_cast<std::uint32_t>(device->place);
  device->config = &config;
  device->protocol = &protocol;
  device->serial = config.serial.value_or(line_.serial);
  device->times = TimesOf(Merge(config.timing, line_.timing), protocol, device->serial);
  device->configured = device->times;
  device->retries = config.retries.value_or(line_.retries);
  device->in_use = config.enabled;
  device->conversation = protocol.make_conversation(config, bus);
  if (carrier_ == &protocol) {
    // A device that routes reach beside its polls: one member for both.
    if (const auto slave = carrier_->carrier->slave_of(config.address)) {
      device->slave = *slave;
      by_slave_.emplace(*slave, device.get());
    }
  }
  everyone_.push_back(device.get());
  devices_.push_back(std::move(device));
}

Member* Roster::FindSlave(std::uint8_t slave) const {
  const auto found = by_slave_.find(slave);
  return found == by_slave_.end() ? nullptr : found->second;
}

Member& Roster::SlaveAt(std::uint8_t address) {
  if (Member* known = FindSlave(address)) return *known;
  auto slave = std::make_unique<Slave>();
  slave->place = everyone_.size();
  slave->index = kFirstSlave + address;
  slave->slave = address;
  slave->protocol = carrier_;
  slave->serial = line_.serial;
  slave->times = TimesOf(line_.timing, *carrier_, line_.serial);
  slave->times.settle = kTurnaround;
  slave->retries = line_.retries;
  by_slave_[address] = slave.get();
  everyone_.push_back(slave.get());
  slaves_.push_back(std::move(slave));
  return *everyone_.back();
}

}  // namespace baudgate
