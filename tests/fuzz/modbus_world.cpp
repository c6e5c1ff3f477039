// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/modbus_world.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string>

#include "tests/fuzz/fuzz.h"

namespace baudgate::fuzz {
namespace {

using config::Access;
using config::Type;

constexpr std::array kTypes = {Type::boolean, Type::int16, Type::uint16, Type::int32,
                               Type::uint32,  Type::int64, Type::uint64, Type::float32,
                               Type::float64, Type::string};
constexpr std::array kAccess = {Access::read_write, Access::read, Access::write};

config::Device MakeDevice(std::uint8_t unit) {
  config::Device device;
  device.name = "unit-" + std::to_string(unit);
  device.unit = unit;
  device.word_order = static_cast<config::WordOrder>(unit % 4);
  device.on_bad = static_cast<config::OnBad>(unit % 3);
  std::uint16_t registers = 0;
  std::uint16_t bits = 0;
  for (std::size_t i = 0; i < 60; ++i) {
    config::Point point;
    point.name = "p" + std::to_string(i);
    point.type = kTypes[i % kTypes.size()];
    point.access = kAccess[(i / kTypes.size()) % kAccess.size()];
    point.writing.allowed = point.access != Access::read && i % 7 != 6;
    point.writing.select = i % 5 == 4;
    if (i % 3 == 1) point.writing.max = 1000;
    if (i % 4 == 2) point.writing.step = 0.5;
    point.text_length = point.type == Type::string ? 1 + i % 9 : 0;
    point.scale = i % 4 == 3 ? 0.1 : 1;
    point.on_fault.kind = static_cast<config::OnFault::Kind>(i % 4);
    point.on_fault.value = static_cast<double>(i) - 30;
    if (point.type == Type::boolean || (i % 7 == 0 && point.type == Type::uint16)) {
      point.table = config::Table::bits;
      point.modbus = bits++;
    } else {
      point.modbus = registers;
      registers = static_cast<std::uint16_t>(registers + config::RegisterCount(point) + i % 2);
    }
    device.points.push_back(point);
  }
  device.points.back().modbus = 19'990;
  return device;
}

void AddRoute(config::Config& config, std::uint8_t first, std::uint8_t last, int remap) {
  config::Route& route = config.modbus.routes.emplace_back();
  route.first = first;
  route.last = last;
  route.line = config.lines[1].name;
  route.line_index = 1;
  if (remap >= 0) route.remap = static_cast<std::uint8_t>(remap);
}

Value StoredValue(Type type, std::size_t choice) {
  constexpr double kNumbers[] = {0, 1, -1, 65535, 1e9, -1e18, 1e300, 0.5};
  const double number = kNumbers[choice % std::size(kNumbers)];
  switch (type) {
    case Type::boolean:
      return choice % 2 == 0;
    case Type::string:
      return std::string(choice % 12, 'x');
    case Type::float32:
    case Type::float64:
      return choice % 9 == 8 ? std::numeric_limits<double>::quiet_NaN() : number;
    case Type::uint64:
      return std::numeric_limits<std::uint64_t>::max() - choice;
    default:
      return static_cast<std::int64_t>(choice) - 40;
  }
}

}  // namespace

const config::Config& ModbusConfig() {
  static const config::Config config = [] {
    config::Config made;
    made.lines.resize(2);
    made.lines[0].name = "line";
    made.lines[1].name = "drive";
    for (const std::uint8_t unit : std::array<std::uint8_t, 4>{1, 2, 3, 247}) {
      made.lines[0].devices.push_back(MakeDevice(unit));
    }
    AddRoute(made, 4, 20, -1);
    AddRoute(made, 15, 100, 1);
    AddRoute(made, 255, 255, 0);
    return made;
  }();
  return config;
}

Instant ModbusNow() { return Instant(24h); }

bus::PointStore& FilledStore() {
  static bus::PointStore store(ModbusConfig());
  static const bool filled = [] {
    constexpr Quality kQualities[] = {Quality::good, Quality::good, Quality::uncertain,
                                      Quality::bad_sensor_failure, Quality::bad_communication};
    for (std::uint32_t device = 0; device < store.device_count(); ++device) {
      const auto its = store.device(device);
      const auto& points = its->points;
      for (std::uint32_t i = 0; i < points.size(); i += 1 + device) {
        const bus::Sample sample{i, StoredValue(points[i].type, i + device),
                                 kQualities[(i + device) % std::size(kQualities)]};
        store.Update(device, std::span(&sample, 1), {ModbusNow() - i * 1s, {}}, 10ms);
      }
    }
    store.SetOverride(2, Quality::bad_communication);
    return true;
  }();
  Require(filled, "the store is filled once");
  return store;
}

bool FuzzSink::Submit(bus::WriteCommand command) {
  Require(command.device < FilledStore().device_count(), "a write is for a device");
  const auto device = FilledStore().device(command.device);
  const auto& points = device->points;
  Require(!command.writes().empty(), "a write writes something");
  for (const bus::PointWrite& write : command.writes()) {
    Require(write.point < points.size(), "a write is for a point of the device");
    Require(points[write.point].writing.allowed, "what may not be written is not");
    Require(HasValue(write.raw), "a write has a value");
  }
  switch (turn++ % 4) {
    case 0:
      return false;
    case 1:
      command.done({});
      return true;
    case 2:
      command.done({WriteEnd::refused, "no"});
      return true;
    default:
      kept.push_back(std::move(command));
      return true;
  }
}

bool FuzzTarget::Submit(bus::RoutedRequest request) {
  Require(!request.pdu.empty() && request.pdu.size() <= 253, "a PDU has its length");
  Require(request.pdu[0] >= 1 && request.pdu[0] < 0x80, "a routed function is one");
  Require(request.deadline > request.arrived, "a request has time");
  const std::uint8_t how = turn++ % 4;
  if (how == 0) return false;
  kept.push_back(std::move(request));
  if (how == 1) AnswerKept(Outcome::ok);
  return true;
}

void FuzzTarget::Abandon(std::uint64_t client) {
  const auto gone = std::stable_partition(
      kept.begin(), kept.end(),
      [client](const bus::RoutedRequest& request) { return request.client != client; });
  std::for_each(gone, kept.end(),
                [](const bus::RoutedRequest& request) { request.done(bus::Abandoned(false)); });
  kept.erase(gone, kept.end());
}

void FuzzTarget::AnswerKept(Outcome outcome) {
  if (kept.empty()) return;
  const bus::RoutedRequest request = std::move(kept.front());
  kept.pop_front();
  const std::uint8_t function = request.pdu[0];
  const bool write = function == 5 || function == 6 || function == 15 || function == 16;
  bus::RoutedReply reply;
  reply.outcome = outcome;
  if (outcome == Outcome::refused) {
    reply.pdu = {static_cast<std::uint8_t>(function | 0x80U), 2};
  } else if (write) {
    reply.pdu = {function, 0, 1, 0, 1};
  } else {
    reply.pdu = {function, 2, 0xAB, 0xCD};
  }
  request.done(reply);
}

void CheckModbusAnswer(View request, View answer) {
  const ByteReader head(answer);
  Require(answer.size() >= 9 && answer.size() <= modbus::kMaxAdu, "an answer has its length");
  Require(std::equal(answer.begin(), answer.begin() + 2, request.begin()), "transaction id echoed");
  Require(*head.U16Be(2) == 0, "protocol id is 0");
  Require(*head.U16Be(4) + modbus::kMbapPrefix == answer.size(), "the length field is right");
  Require(answer[6] == request[6], "unit id echoed");
  const std::uint8_t function = request[7];
  if (answer[7] != function || function >= 0x80) {
    Require(answer[7] == (function | 0x80U), "the function, or its exception");
    Require(answer.size() == 9 && answer[8] >= 1 && answer[8] <= 0x0B, "an exception code");
    return;
  }
  const auto count = ByteReader(request).U16Be(10);
  Require(count.has_value(), "a good answer is to a whole request");
  if (function <= 4) {
    const std::size_t bytes =
        function <= 2 ? (std::size_t{*count} + 7) / 8 : std::size_t{*count} * 2;
    Require(answer[8] == bytes && answer.size() == 9 + bytes, "as many values as asked for");
  } else {
    Require(std::equal(answer.begin() + 7, answer.end(), request.begin() + 7, request.begin() + 12),
            "a write is confirmed with its address and count");
  }
}

}  // namespace baudgate::fuzz
