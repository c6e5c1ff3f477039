// Makes, sends and receives Modbus TCP frames, so that a test can have many requests outstanding.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "gateway/base/bytes.h"
#include "tests/support/raw_client.h"

namespace baudgate::system_test {

struct Message {
  std::uint16_t transaction = 0;
  std::uint8_t unit = 0;
  Bytes pdu;
};

Bytes FrameOf(const Message& message);
void Send(const RawClient& client, const Message& message);
std::optional<Message> Receive(const RawClient& client);

Message ReadRequest(std::uint16_t transaction, std::uint8_t unit, std::uint16_t address,
                    std::uint16_t count = 1);
Message WriteRequest(std::uint16_t transaction, std::uint8_t unit, std::uint16_t address,
                     std::uint16_t value);
int ExceptionIn(const Message& message);
/// Returns the registers of the reply; empty if the message is not a reply to a read.
std::vector<std::uint16_t> RegistersIn(const Message& message);

}  // namespace baudgate::system_test
