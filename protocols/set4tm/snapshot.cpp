// The mask of 08 23: bit numbers of float parameters, both ways.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/snapshot.h"

#include <array>

#include "protocols/set4tm/codec.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr std::size_t kMaskAt = 4;
constexpr std::size_t kMaskSize = 8;
constexpr std::size_t kRequestSize = kMaskAt + kMaskSize;
constexpr std::uint8_t kNone = 0xFF;

/// From the lowest bit of m8 to the highest of m2.
constexpr std::array<std::uint8_t, 56> kByBit = {
    0x00, 0x01, 0x02, 0x03, 0x04,  0x05,  0x06,  0x07,   // m8: P, Q
    0x08, 0x09, 0x0A, 0x0B, 0x30,  0x31,  0x32,  0x33,   // m7: S, cos
    0x1C, 0x11, 0x12, 0x13, 0x18,  0x15,  0x16,  0x17,   // m6: Ubat, U, U1(1), line U
    0x2C, 0x21, 0x22, 0x23, 0x28,  0x25,  0x26,  0x27,   // m5: K0i, I, K2i, KI
    0x8C, 0x81, 0x82, 0x83, 0x88,  0x85,  0x86,  0x87,   // m4: K0u, KU, K2u, line KU
    0xE0, 0xE1, 0xE2, 0xE3, 0x40,  0x70,  kNone, kNone,  // m3: P of losses, f, T
    0xE4, 0xE5, 0xE6, 0xE7, kNone, kNone, kNone, kNone,  // m2: Q of losses
};

/// Modes whose phase field 0 acts as phase 1: voltage, current, distortion, and the averaged ones.
bool ZeroIsPhaseOne(std::uint8_t parameter) {
  const unsigned mode = parameter >> 4U;
  return mode == 1 || mode == 2 || mode == 8 || mode == 0xA || mode == 0xB;
}

bool HasPhases(std::uint8_t parameter) {
  const unsigned mode = parameter >> 4U;
  if (mode == 4 || mode == 7 || mode == 9) return false;  // frequency, temperature
  // Positive sequence, unbalance and battery are one value each.
  return !(ZeroIsPhaseOne(parameter) && (parameter & 0x0CU) >= 8U);
}

}  // namespace

std::optional<std::uint8_t> ParameterAt(View pdu, std::size_t offset) {
  if (pdu.size() != 4 || pdu[0] != kRead || pdu[1] != kFloats || offset % 4 != 0) {
    return std::nullopt;
  }
  const bool group = pdu[2] == 2;
  if ((pdu[2] != 0 && !group) || offset / 4 > (group ? 3U : 0U)) return std::nullopt;
  std::uint8_t parameter = pdu[3];
  if (!HasPhases(parameter)) {
    // All phase fields of these mean the same.
    return static_cast<std::uint8_t>(ZeroIsPhaseOne(parameter) ? parameter & 0xFCU
                                                               : parameter & 0xF0U);
  }
  if (group) parameter = static_cast<std::uint8_t>((parameter & 0xFCU) | (offset / 4));
  if (ZeroIsPhaseOne(parameter) && (parameter & 3U) == 0) ++parameter;
  return parameter;
}

std::optional<unsigned> MaskBit(std::uint8_t parameter) {
  if (parameter == kNone) return std::nullopt;
  for (unsigned bit = 0; bit < kByBit.size(); ++bit) {
    if (kByBit[bit] == parameter) return bit;
  }
  return std::nullopt;
}

std::optional<std::uint8_t> MaskedParameter(unsigned bit) {
  if (bit >= kByBit.size() || kByBit[bit] == kNone) return std::nullopt;
  return kByBit[bit];
}

bool IsMasked(View pdu) { return pdu.size() > 2 && pdu[0] == kRead && pdu[1] == kFloatMask; }

Bytes MaskRequest(std::uint8_t id, const std::vector<unsigned>& bits) {
  Bytes pdu(kRequestSize);
  pdu[0] = kRead;
  pdu[1] = kFloatMask;
  pdu[2] = id;
  for (const unsigned bit : bits) {
    std::uint8_t& mask = pdu[kRequestSize - 1 - bit / 8];
    mask = static_cast<std::uint8_t>(mask | (1U << (bit % 8)));
  }
  return pdu;
}

std::vector<unsigned> MaskBits(View pdu) {
  std::vector<unsigned> bits;
  if (pdu.size() != kRequestSize || pdu[0] != kRead || pdu[1] != kFloatMask) return bits;
  for (unsigned bit = 0; bit < kMaskSize * 8; ++bit) {
    if (((pdu[kRequestSize - 1 - bit / 8] >> (bit % 8)) & 1U) != 0) bits.push_back(bit);
  }
  return bits;
}

}  // namespace baudgate::protocols::set4tm
