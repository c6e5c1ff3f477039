// Frames of Modbus TCP, as many at once as a test likes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "gateway/base/bytes.h"
#include "tests/support/raw_client.h"

namespace baudgate::system_test {

/// A frame of Modbus TCP taken apart.
struct Message {
  std::uint16_t transaction = 0;
  std::uint8_t unit = 0;
  Bytes pdu;
};

Bytes FrameOf(const Message& message);
void Send(const RawClient& client, const Message& message);
/// The next frame; nothing when it does not come, or the server closes.
std::optional<Message> Receive(const RawClient& client);

/// A read of holding registers.
Message ReadRequest(std::uint16_t transaction, std::uint8_t unit, std::uint16_t address,
                    std::uint16_t count = 1);
/// A write of one register.
Message WriteRequest(std::uint16_t transaction, std::uint8_t unit, std::uint16_t address,
                     std::uint16_t value);
/// Code of the exception that the frame is; 0: it is none.
int ExceptionIn(const Message& message);
/// The registers in the reply to a read; empty: it is none.
std::vector<std::uint16_t> RegistersIn(const Message& message);

}  // namespace baudgate::system_test
