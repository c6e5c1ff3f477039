// Builds Modbus slaves and PDUs in hex for tests. The frames belong to slave 20.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/text.h"
#include "protocols/assembler.h"
#include "protocols/modbus/codec.h"
#include "protocols/modbus/conversation.h"
#include "protocols/modbus/protocol.h"
#include "protocols/modbus/rules.h"
#include "protocols/modbus/twin.h"
#include "tests/support/talk.h"

namespace baudgate::protocols::modbus {

inline constexpr std::uint8_t kSlave = 20;

inline Bytes Hex(std::string_view text) {
  const auto bytes = ParseHex(text);
  EXPECT_TRUE(bytes.has_value()) << text;
  return bytes.value_or(Bytes());
}

inline const Protocol& ProtocolOf(Framing framing) {
  if (framing == Framing::tcp) return ModbusTcpProtocol();
  return framing == Framing::rtu ? ModbusRtuProtocol() : ModbusAsciiProtocol();
}

inline config::Point ReadPoint(const std::string& name, const std::string& read,
                               config::Type type = config::Type::uint16,
                               config::Group group = config::Group::fast) {
  return baudgate::ReadPoint(name, read, type, group);
}

inline config::Point WritePoint(const std::string& name, const std::string& read,
                                const std::string& write = {},
                                config::Type type = config::Type::uint16) {
  return baudgate::WritePoint(name, read, write, type);
}

inline config::Options MakeOptions(const Settable& given = {}) {
  return OptionsOf(ModbusRtuProtocol(), given);
}

inline config::Device MakeDevice(std::vector<config::Point> points, const Settable& options = {},
                                 const std::string& address = std::to_string(kSlave)) {
  return DeviceOf(ModbusRtuProtocol(), address, std::move(points), options);
}

inline Bytes AskTwin(Twin& twin, View pdu) {
  const Bytes reply =
      baudgate::AskTwin(ModbusRtuProtocol(), twin, MakeOptions(), Wrap(Framing::rtu, kSlave, pdu));
  const auto adu = Unwrap(Framing::rtu, reply);
  return adu ? adu->pdu : Bytes();
}

inline std::string Asked(Talk& talk, const Task& task) {
  const auto request = talk.Ask(task);
  if (!request) return "error: " + request.error();
  const auto sent = talk.protocol().carrier->unwrap_request(request->bytes);
  return sent ? ToHex(sent->second) : "no frame";
}
inline Answer Exchange(Talk& talk, const Task& task, std::string_view pdu) {
  if (pdu.empty()) return talk.Exchange(task, View());
  return talk.Exchange(task, talk.protocol().carrier->wrap(kSlave, Hex(pdu)));
}

}  // namespace baudgate::protocols::modbus
