// Builders of Modbus requests, function code and data, the same in both framings. Codes, lengths
// and checks: protocols/modbus/pdu/modbus_pdu.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gateway/base/bytes.h"
#include "protocols/modbus/pdu/modbus_pdu.h"

namespace baudgate::protocols::modbus {

using namespace baudgate::modbus;  // the rules that the gateway shares

Bytes ReadRequest(std::uint8_t function, std::uint16_t address, std::size_t count);
Bytes WriteCoilRequest(std::uint16_t address, bool on);
Bytes WriteCoilsRequest(std::uint16_t address, const std::vector<bool>& bits);
Bytes WriteRegisterRequest(std::uint16_t address, std::uint16_t value);
Bytes WriteRegistersRequest(std::uint16_t address, const std::vector<std::uint16_t>& values);
Bytes MaskWriteRequest(std::uint16_t address, std::uint16_t keep, std::uint16_t set);
/// Sub-function 0: the device sends the same back.
Bytes LoopbackRequest(std::uint16_t data);

void AppendU16(Bytes& to, std::size_t value);
/// High byte first.
Bytes BytesOf(const std::vector<std::uint16_t>& words);
/// Eight to a byte, the first in bit 0.
Bytes PackBits(const std::vector<bool>& bits);

}  // namespace baudgate::protocols::modbus
