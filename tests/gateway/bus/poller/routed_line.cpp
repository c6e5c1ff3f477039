// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/bus/poller/routed_line.h"

#include <gtest/gtest.h>

#include <utility>

#include "config/catalog/option_values.h"
#include "gateway/base/text.h"
#include "protocols/modbus/protocol.h"

namespace baudgate::bus {
namespace {

std::vector<config::Device> Slaves(const std::vector<std::string>& addresses) {
  std::vector<config::Device> devices;
  for (const std::string& address : addresses) devices.push_back(Slave(address));
  return devices;
}

}  // namespace

std::string ReadOf(std::uint8_t reg) { return "03 00 " + HexByte(reg) + " 00 01"; }

config::Device Slave(const std::string& address) {
  config::Device device;
  device.name = "slave" + address;
  device.address = address;
  device.protocol = "modbus_rtu";
  device.options = config::DefaultOptions(protocols::ModbusRtuProtocol());
  for (int i = 0; i < 120; ++i) {
    config::Point point;
    point.name = "r" + std::to_string(i);
    point.read = "holding " + std::to_string(i);
    point.type = config::Type::uint16;
    point.access = config::Access::read_write;
    device.points.push_back(std::move(point));
  }
  return device;
}

config::Device Polled(const std::string& address, std::size_t points, Duration poll) {
  config::Device device = Slave(address);
  device.points.resize(points);
  device.poll = poll;
  return device;
}

config::Line DriveLine(std::vector<config::Device> devices) {
  config::Line line;
  line.name = "drive";
  line.protocol = "modbus_rtu";
  line.serial.baud = 19200;
  line.serial.parity = config::Parity::even;
  line.options = config::DefaultOptions(protocols::ModbusRtuProtocol());
  line.devices = std::move(devices);
  return line;
}

Bytes Damaged(Bytes frame) {
  frame.back() ^= 0xFF;
  return frame;
}

RoutedLine::RoutedLine(config::Line line, const std::vector<std::string>& slaves)
    : RoutedLine(Slaves(slaves), std::move(line)) {}

RoutedLine::RoutedLine(std::vector<config::Device> slaves, config::Line line)
    : VirtualLine(std::move(line), {&protocols::ModbusRtuProtocol(), &ToyProtocol()},
                  std::move(slaves)) {
  Open();
}

void RoutedLine::Number(std::size_t index, std::uint64_t base) {
  for (std::uint32_t i = 0; i < 120; ++i) twin(index).values.Set(i, base + i);
}

void RoutedLine::Ask(std::string name, const std::string& pdu, std::uint8_t slave,
                     std::uint64_t client, config::Priority priority, Duration within) {
  RoutedRequest request;
  request.client = client;
  request.slave = slave;
  request.pdu = ParseHex(pdu).value();
  request.priority = priority;
  request.arrived = now().instant;
  request.deadline = now().instant + within;
  request.done = [this, name = std::move(name)](RoutedReply reply) {
    replies.push_back({name, now().instant, std::move(reply)});
  };
  Submit(std::move(request));
}

std::vector<std::string> RoutedLine::Names() const {
  std::vector<std::string> names;
  for (const Reply& reply : replies) names.push_back(reply.name);
  return names;
}

const RoutedReply& RoutedLine::Of(const std::string& name) const {
  for (const Reply& reply : replies) {
    if (reply.name == name) return reply.reply;
  }
  static const RoutedReply kNone;
  ADD_FAILURE() << name << " has no answer";
  return kNone;
}

std::vector<std::string> RoutedLine::OnWire() const {
  std::vector<std::string> frames;
  for (const Sent& one : sent) {
    const Bytes bytes = ToBytes(one.text);
    frames.push_back(ToHex(View(bytes).first(bytes.size() - 2)));
  }
  return frames;
}

BusyClients::BusyClients(RoutedLine& line) : line_(line) {
  line.always = [this] { AskAgain(); };
}

void BusyClients::Add(const std::string& pdu, std::uint8_t slave, config::Priority priority) {
  clients_.push_back({pdu, slave, priority, 0, 0, false});
  AskAgain();
}

void BusyClients::AskAgain() {
  for (std::size_t i = 0; i < clients_.size(); ++i) {
    if (std::exchange(clients_[i].waits, true)) continue;
    RoutedRequest request;
    request.client = 100 + i;
    request.slave = clients_[i].slave;
    request.pdu = ParseHex(clients_[i].pdu).value();
    request.priority = clients_[i].priority;
    request.arrived = line_.now().instant;
    request.deadline = line_.now().instant + 2500ms;
    request.done = [this, i](const RoutedReply& reply) {
      ++(reply.outcome == Outcome::ok ? clients_[i].answered : clients_[i].failed);
      clients_[i].waits = false;
    };
    line_.Submit(std::move(request));
  }
}

}  // namespace baudgate::bus
