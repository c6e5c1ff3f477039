// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/checksum.h"

#include <zlib.h>

#include <array>
#include <numeric>

#include "gateway/base/checksum.h"

namespace baudgate::protocols::telegram {
namespace {

std::uint32_t Ccitt(View bytes, std::uint16_t start) {
  std::uint32_t crc = start;
  for (const std::uint8_t byte : bytes) {
    crc ^= static_cast<std::uint32_t>(byte) << 8U;
    for (int bit = 0; bit < 8; ++bit) {
      crc = ((crc & 0x8000U) != 0 ? (crc << 1U) ^ 0x1021U : crc << 1U) & 0xFFFFU;
    }
  }
  return crc;
}

constexpr std::array<ChecksumKind, 8> kKinds = {
    {{"sum8", 1, [](View bytes) -> std::uint32_t { return Sum8(bytes); }},
     {"sum16", 2,
      [](View bytes) {
        return std::accumulate(bytes.begin(), bytes.end(), std::uint32_t{0}) & 0xFFFFU;
      }},
     {"xor8", 1, [](View bytes) -> std::uint32_t { return Xor8(bytes); }},
     {"lrc", 1, [](View bytes) { return (0x100U - Sum8(bytes)) & 0xFFU; }},
     {"crc16_modbus", 2, [](View bytes) -> std::uint32_t { return Crc16(bytes); }},
     {"crc16_ccitt", 2, [](View bytes) { return Ccitt(bytes, 0xFFFF); }},
     {"crc16_xmodem", 2, [](View bytes) { return Ccitt(bytes, 0); }},
     {"crc32", 4, [](View bytes) {
        return static_cast<std::uint32_t>(
            crc32_z(0, bytes.data(), static_cast<z_size_t>(bytes.size())));
      }}}};

}  // namespace

std::span<const ChecksumKind> ChecksumKinds() { return kKinds; }

std::optional<std::uint32_t> Checksum::Of(View front) const {
  if (front.size() <= skip + leave) return std::nullopt;
  return kind->compute(front.subspan(skip, front.size() - skip - leave));
}

}  // namespace baudgate::protocols::telegram
