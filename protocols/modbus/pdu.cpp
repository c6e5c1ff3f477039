// Builds requests, as the MODBUS Application Protocol V1.1b3 has them.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/pdu.h"

namespace baudgate::protocols::modbus {

void AppendU16(Bytes& to, std::size_t value) {
  to.push_back(static_cast<std::uint8_t>((value >> 8U) & 0xFFU));
  to.push_back(static_cast<std::uint8_t>(value & 0xFFU));
}

Bytes BytesOf(const std::vector<std::uint16_t>& words) {
  Bytes bytes;
  for (const std::uint16_t word : words) AppendU16(bytes, word);
  return bytes;
}

Bytes PackBits(const std::vector<bool>& bits) {
  Bytes bytes(PackedSize(bits.size()));
  for (std::size_t i = 0; i < bits.size(); ++i) {
    if (bits[i]) bytes[i / 8] = static_cast<std::uint8_t>(bytes[i / 8] | (1U << (i % 8)));
  }
  return bytes;
}

Bytes ReadRequest(std::uint8_t function, std::uint16_t address, std::size_t count) {
  Bytes pdu = {function};
  AppendU16(pdu, address);
  AppendU16(pdu, count);
  return pdu;
}

Bytes WriteCoilRequest(std::uint16_t address, bool on) {
  return ReadRequest(kWriteCoil, address, on ? 0xFF00 : 0);
}

Bytes WriteCoilsRequest(std::uint16_t address, const std::vector<bool>& bits) {
  Bytes pdu = ReadRequest(kWriteCoils, address, bits.size());
  const Bytes packed = PackBits(bits);
  pdu.push_back(static_cast<std::uint8_t>(packed.size()));
  Append(pdu, packed);
  return pdu;
}

Bytes WriteRegisterRequest(std::uint16_t address, std::uint16_t value) {
  return ReadRequest(kWriteRegister, address, value);
}

Bytes WriteRegistersRequest(std::uint16_t address, const std::vector<std::uint16_t>& values) {
  Bytes pdu = ReadRequest(kWriteRegisters, address, values.size());
  pdu.push_back(static_cast<std::uint8_t>(2 * values.size()));
  for (const std::uint16_t value : values) AppendU16(pdu, value);
  return pdu;
}

Bytes MaskWriteRequest(std::uint16_t address, std::uint16_t keep, std::uint16_t set) {
  Bytes pdu = ReadRequest(kMaskWrite, address, keep);
  AppendU16(pdu, set);
  return pdu;
}

Bytes LoopbackRequest(std::uint16_t data) { return ReadRequest(kDiagnostics, 0, data); }

}  // namespace baudgate::protocols::modbus
