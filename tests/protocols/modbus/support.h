// Small tools of the Modbus tests: devices with their options, the frames of the reference, and one
// exchange between a conversation and a twin through the real frame rules.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/catalog/option_values.h"
#include "gateway/base/text.h"
#include "gateway/line/assembler.h"
#include "protocols/modbus/codec.h"
#include "protocols/modbus/conversation.h"
#include "protocols/modbus/expect.h"
#include "protocols/modbus/pdu.h"
#include "protocols/modbus/protocol.h"
#include "protocols/modbus/twin.h"
#include "tests/support/twin_exchange.h"

namespace baudgate::protocols::modbus {

using Settable = std::vector<std::pair<std::string, config::OptionValue>>;

inline Bytes Hex(std::string_view text) {
  const auto bytes = ParseHex(text);
  EXPECT_TRUE(bytes.has_value()) << text;
  return bytes.value_or(Bytes());
}

inline const Protocol& ProtocolOf(Framing framing) {
  return framing == Framing::rtu ? ModbusRtuProtocol() : ModbusAsciiProtocol();
}

inline config::Point ReadPoint(const std::string& name, const std::string& read,
                               config::Type type = config::Type::uint16,
                               config::Group group = config::Group::fast) {
  config::Point point;
  point.name = name;
  point.read = read;
  point.type = type;
  point.group = group;
  return point;
}

inline config::Point WritePoint(const std::string& name, const std::string& read,
                                const std::string& write = {},
                                config::Type type = config::Type::uint16) {
  config::Point point = ReadPoint(name, read, type);
  point.write = write;
  point.access = read.empty() ? config::Access::write : config::Access::read_write;
  return point;
}

inline config::Options MakeOptions(const Settable& given = {}) {
  config::Options options = config::DefaultOptions(ModbusRtuProtocol());
  for (const auto& [name, value] : given) {
    EXPECT_TRUE(options.Has(name)) << name;
    options.Set(name, value);
  }
  return options;
}

inline config::Device MakeDevice(std::vector<config::Point> points, const Settable& options = {},
                                 const std::string& address = "20") {
  config::Device device;
  device.name = "slave";
  device.title = "Test Slave";
  device.address = address;
  device.protocol = "modbus_rtu";
  device.options = MakeOptions(options);
  device.points = std::move(points);
  for (const config::Point& point : device.points) {
    const Status status = ModbusRtuProtocol().check_point(point);
    EXPECT_TRUE(status) << point.name << ": " << (status ? "" : status.error());
  }
  const Status status = ModbusRtuProtocol().check_device(device);
  EXPECT_TRUE(status) << (status ? "" : status.error());
  return device;
}

/// What the twin says to a PDU, as a PDU.
inline Bytes AskTwin(Twin& twin, View pdu, std::uint8_t slave = 20,
                     Framing framing = Framing::rtu) {
  const Bytes frame =
      CutFrame(ProtocolOf(framing).request_rule, Expect(framing, {}), Wrap(framing, slave, pdu));
  EXPECT_FALSE(frame.empty());
  const auto adu = Unwrap(framing, twin.Answer(frame, Instant{}));
  return adu ? adu->pdu : Bytes();
}

inline Task Poll(std::size_t query) {
  return {.kind = Task::Kind::poll, .query = query, .point = kNoPoint, .value = {}};
}
inline Task Probe() {
  return {.kind = Task::Kind::probe, .query = 0, .point = kNoPoint, .value = {}};
}
inline Task Write(std::size_t point, Value value) {
  return {.kind = Task::Kind::write, .query = 0, .point = point, .value = std::move(value)};
}

/// Asks, takes `wire` for what comes back, and gives the answer; no whole frame gives what was
/// blamed.
inline Answer ExchangeBytes(Conversation& talk, const Task& task, View wire,
                            Framing framing = Framing::rtu) {
  Answer answer;
  const auto request = talk.Ask(task, Instant{});
  if (!request) {
    answer.outcome = Outcome::unsupported;
    answer.reason = request.error();
    return answer;
  }
  Assembler assembler;
  assembler.Begin(ProtocolOf(framing).reply_rule, request->expect);
  assembler.Feed(wire);
  const auto frame = assembler.Next(true);
  if (frame) return talk.OnFrame(task, *request, *frame, Instant{});
  answer.outcome = assembler.blame() == Outcome::none ? Outcome::no_reply : assembler.blame();
  answer.reason = assembler.why();
  answer.then = talk.OnFailure(task, *request, answer.outcome, Instant{});
  return answer;
}

/// The same with the PDU of slave 20 as a reply.
inline Answer Exchange(Conversation& talk, const Task& task, std::string_view pdu) {
  const Bytes wire = pdu.empty() ? Bytes() : Wrap(Framing::rtu, 20, Hex(pdu));
  return ExchangeBytes(talk, task, wire);
}

/// The PDU that is sent for a task, in hex.
inline std::string Asked(Conversation& talk, const Task& task, Framing framing = Framing::rtu) {
  const auto request = talk.Ask(task, Instant{});
  if (!request) return "error: " + request.error();
  const auto adu = Unwrap(framing, request->bytes);
  return adu ? ToHex(adu->pdu) : "no frame";
}

inline Answer RoundTrip(Conversation& talk, Twin& twin, const Task& task,
                        Framing framing = Framing::rtu) {
  const auto request = talk.Ask(task, Instant{});
  EXPECT_TRUE(request) << (request ? "" : request.error());
  if (!request) return {};
  const Bytes heard =
      CutFrame(ProtocolOf(framing).request_rule, Expect(framing, {}), request->bytes);
  EXPECT_FALSE(heard.empty());
  const Bytes reply = twin.Answer(heard, Instant{});
  const Bytes frame = CutFrame(ProtocolOf(framing).reply_rule, request->expect, reply);
  EXPECT_FALSE(frame.empty()) << ToHex(request->bytes) << " got " << ToHex(reply);
  return frame.empty() ? Answer{} : talk.OnFrame(task, *request, frame, Instant{});
}

}  // namespace baudgate::protocols::modbus
