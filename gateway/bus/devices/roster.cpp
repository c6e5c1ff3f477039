// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/devices/roster.h"

#include <algorithm>
#include <utility>

namespace baudgate::bus {

namespace {

/// Silence after a broadcast. Slaves do not answer a broadcast, but need time to carry it out: 100
/// to 200 ms according to MODBUS over Serial Line 1.02, 2.4.1.
constexpr Duration kTurnaround = 100ms;

LineTimes TimesOf(const config::Timing& timing, const config::SerialSettings& serial) {
  return {.quiet = *timing.quiet,
          .reply = *timing.reply,
          .gap = *timing.gap,
          .ceiling = *timing.ceiling,
          .drain = *timing.drain,
          .settle = {},
          .character = serial.CharacterTime()};
}

}  // namespace

std::string Member::Name() const {
  return device == nullptr ? "slave " + std::to_string(slave) : device->config->name;
}

bool Device::LearnTimes() {
  const config::Timing learned = Lengthen(configured, conversation->LeastTimes(times.character));
  if (learned == timing) return false;
  timing = learned;
  times = TimesOf(timing, serial);
  return true;
}

Roster::Roster(const config::Line& line, std::uint32_t first_device, const FindProtocol& find)
    : line_(line), first_device_(first_device) {
  const protocols::Protocol& own = find(line.protocol);
  if (own.carrier != nullptr) carrier_ = &own;
  std::vector<std::pair<const protocols::Protocol*, protocols::Bus*>> made;
  for (const config::Device& config : line.devices) {
    const protocols::Protocol& protocol = find(config.protocol);
    auto known = std::ranges::find(made, &protocol, [](const auto& pair) { return pair.first; });
    if (known == made.end()) {
      buses_.push_back(MakeBus(protocol));
      known = made.insert(made.end(), {&protocol, buses_.back().get()});
    }
    AddDevice(config, protocol, known->second);
  }
}

void Roster::AddDevice(const config::Device& config, const protocols::Protocol& protocol,
                       protocols::Bus* bus) {
  auto device = std::make_unique<Device>(config);
  device->place = devices_.size();
  device->index = first_device_ + static_cast<std::uint32_t>(device->place);
  device->protocol = &protocol;
  device->options = ParseOptions(protocol, config.options);
  device->serial = config.serial.value_or(line_.serial);
  device->timing = Resolve(Merge(config.timing, line_.timing), protocol.timing(device->serial));
  device->configured = device->timing;
  device->times = TimesOf(device->timing, device->serial);
  device->max_retries = config.retries.value_or(line_.retries);
  device->in_use = config.enabled;
  device->conversation = protocol.make_conversation(config, device->options, bus);
  if (carrier_ == &protocol) {
    // Routes that send to this address use the polled device, so no slave is added for it.
    if (const auto slave = carrier_->carrier->slave_of(config.address)) {
      device->slave = *slave;
      by_slave_.emplace(*slave, device.get());
    }
  }
  everyone_.push_back(device.get());
  devices_.push_back(std::move(device));
}

Device* Roster::Speaker() const {
  const auto speaks = [](const auto& device) { return device->conversation->Listens() != nullptr; };
  const auto found = std::ranges::find_if(devices_, speaks);
  return found == devices_.end() ? nullptr : found->get();
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
  slave->options = ParseOptions(*carrier_, line_.options);
  slave->serial = line_.serial;
  slave->times = TimesOf(Resolve(line_.timing, carrier_->timing(line_.serial)), line_.serial);
  slave->times.settle = kTurnaround;
  slave->max_retries = line_.retries;
  by_slave_[address] = slave.get();
  everyone_.push_back(slave.get());
  slaves_.push_back(std::move(slave));
  return *everyone_.back();
}

}  // namespace baudgate::bus
