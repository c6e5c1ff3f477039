// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/codec.h"

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"

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

namespace {

std::uint8_t Lrc(View bytes) { return static_cast<std::uint8_t>(0x100U - Sum8(bytes)); }

std::optional<Adu> UnwrapRtu(View frame) {
  if (frame.size() < kRtuOverhead + 1 || frame.size() > kMaxRtu || !EndsInCrc16(frame)) {
    return std::nullopt;
  }
  return Adu{frame[0], Bytes(frame.begin() + 1, frame.end() - 2)};
}

std::optional<Adu> UnwrapAscii(View frame) {
  if (!frame.empty() && frame.back() == '\n') frame = frame.first(frame.size() - 1);
  if (frame.size() < 2 || frame.front() != ':' || frame.back() != '\r') return std::nullopt;
  const std::string_view digits = AsText(frame.subspan(1, frame.size() - 2));
  if (digits.find(' ') != std::string_view::npos) return std::nullopt;
  const auto bytes = ParseHex(digits);
  if (!bytes || bytes->size() < 3 || bytes->size() > kMaxPdu + 2) return std::nullopt;
  if (Sum8(*bytes) != 0) return std::nullopt;
  return Adu{bytes->front(), Bytes(bytes->begin() + 1, bytes->end() - 1)};
}

std::optional<Adu> UnwrapTcp(View frame) {
  if (frame.size() <= kTcpOverhead) return std::nullopt;
  return Adu{frame[6], Bytes(frame.begin() + kTcpOverhead, frame.end()),
             *ByteReader(frame).U16Be(0)};
}

Bytes WrapTcp(std::uint8_t slave, View pdu, std::uint16_t transaction) {
  Bytes frame;
  AppendU16(frame, transaction);
  AppendU16(frame, 0);
  AppendU16(frame, pdu.size() + kTcpCounted);
  frame.push_back(slave);
  Append(frame, pdu);
  return frame;
}

}  // namespace

std::size_t FrameLength(Framing framing, std::size_t pdu) {
  if (framing == Framing::tcp) return pdu + kTcpOverhead;
  return framing == Framing::rtu ? pdu + kRtuOverhead : 2 * (pdu + 2) + 3;
}

std::size_t MaxFrame(Framing framing) {
  if (framing == Framing::tcp) return kMaxTcp;
  return framing == Framing::rtu ? kMaxRtu : kMaxAscii;
}

std::optional<std::size_t> TcpSize(View header) {
  const ByteReader reader(header);
  const auto protocol = reader.U16Be(2);
  const auto length = reader.U16Be(4);
  if (!protocol || !length || *protocol != 0) return std::nullopt;
  if (*length <= kTcpCounted || *length > kMaxPdu + kTcpCounted) return std::nullopt;
  return kTcpOverhead - kTcpCounted + *length;
}

Bytes Wrap(Framing framing, std::uint8_t slave, View pdu, std::uint16_t transaction) {
  if (framing == Framing::tcp) return WrapTcp(slave, pdu, transaction);
  Bytes bytes;
  bytes.reserve(pdu.size() + 3);
  bytes.push_back(slave);
  Append(bytes, pdu);
  if (framing == Framing::rtu) {
    AppendCrc16(bytes);
    return bytes;
  }
  bytes.push_back(Lrc(bytes));
  Bytes frame = {':'};
  for (const std::uint8_t byte : bytes) Append(frame, std::string_view(HexByte(byte)));
  Append(frame, std::string_view("\r\n"));
  return frame;
}

std::optional<Adu> Unwrap(Framing framing, View frame) {
  if (framing == Framing::tcp) {
    return TcpSize(frame) == frame.size() ? UnwrapTcp(frame) : std::nullopt;
  }
  return framing == Framing::rtu ? UnwrapRtu(frame) : UnwrapAscii(frame);
}

std::optional<Adu> UnwrapReply(Framing framing, View frame) {
  if (framing != Framing::tcp) return Unwrap(framing, frame);
  return TcpSize(frame).value_or(0) >= frame.size() ? UnwrapTcp(frame) : std::nullopt;
}

std::optional<std::uint16_t> ParseNumber(std::string_view text) {
  if (!WhyLeadingZero(text).empty()) return std::nullopt;
  const bool hex = text.starts_with("0x") || text.starts_with("0X");
  return hex ? ParseInteger<std::uint16_t>(text.substr(2), 16) : ParseInteger<std::uint16_t>(text);
}

Result<std::uint8_t> ParseAddress(std::string_view text, Framing framing) {
  const bool tcp = framing == Framing::tcp;
  const auto number = ParseNumber(text);
  if (!number || *number < (tcp ? 0 : 1) || *number > (tcp ? 0xFF : kLastSlave)) {
    return Error{"address '" + std::string(text) + "' is not " + (tcp ? "0...255" : "1...247") +
                 ", or hex as 0x14"};
  }
  return static_cast<std::uint8_t>(*number);
}

}  // namespace baudgate::protocols::modbus
