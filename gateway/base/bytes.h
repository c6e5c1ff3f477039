// Byte sequences of a wire (`Bytes`, `View`) and `ByteReader`, which never reads beyond their end.
// `ModemLines` are the control lines of a serial port; Crc16, Sum8 and Xor8 compute check values.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace baudgate {

using Bytes = std::vector<std::uint8_t>;
using View = std::span<const std::uint8_t>;

inline Bytes ToBytes(std::string_view text) { return Bytes(text.begin(), text.end()); }

/// Returns the same bytes as characters; the result is valid as long as the viewed bytes are.
inline std::string_view AsText(View bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

inline void Append(Bytes& to, View more) { to.insert(to.end(), more.begin(), more.end()); }
inline void Append(Bytes& to, std::string_view more) {
  to.insert(to.end(), more.begin(), more.end());
}

/// Reads numbers from fixed positions of a frame. A read beyond the end returns no value.
class ByteReader {
 public:
  explicit ByteReader(View bytes) : bytes_(bytes) {}

  std::size_t size() const { return bytes_.size(); }
  std::optional<std::uint8_t> U8(std::size_t at) const {
    if (at >= bytes_.size()) return std::nullopt;
    return bytes_[at];
  }
  std::optional<std::uint16_t> U16Be(std::size_t at) const {
    return Unsigned<std::uint16_t, true>(at);
  }
  std::optional<std::uint16_t> U16Le(std::size_t at) const {
    return Unsigned<std::uint16_t, false>(at);
  }
  std::optional<std::uint32_t> U32Be(std::size_t at) const {
    return Unsigned<std::uint32_t, true>(at);
  }
  std::optional<std::uint32_t> U32Le(std::size_t at) const {
    return Unsigned<std::uint32_t, false>(at);
  }
  std::optional<float> F32Le(std::size_t at) const {
    const auto raw = U32Le(at);
    if (!raw) return std::nullopt;
    return std::bit_cast<float>(*raw);
  }
  std::optional<View> Slice(std::size_t at, std::size_t count) const {
    if (at > bytes_.size() || count > bytes_.size() - at) return std::nullopt;
    return bytes_.subspan(at, count);
  }

 private:
  template <typename T, bool kBigEndian>
  std::optional<T> Unsigned(std::size_t at) const {
    const auto slice = Slice(at, sizeof(T));
    if (!slice) return std::nullopt;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      const std::size_t index = kBigEndian ? i : sizeof(T) - 1 - i;
      value = (value << 8) | (*slice)[index];
    }
    return static_cast<T>(value);
  }

  View bytes_;
};

struct ModemLines {
  bool dtr = false;  ///< output of this machine, as is rts
  bool rts = false;
  bool cts = false;  ///< input from the device, as are dsr, dcd and ring
  bool dsr = false;
  bool dcd = false;
  bool ring = false;

  bool operator==(const ModemLines&) const = default;
};

/// CRC-16/MODBUS: reflected polynomial 0xA001, start 0xFFFF, no final XOR. Check("123456789") =
/// 0x4B37.
std::uint16_t Crc16(View bytes);
/// Appends the CRC of `bytes`, low byte first.
void AppendCrc16(Bytes& bytes);
/// True if the frame has at least three bytes and its last two are the CRC of the bytes before
/// them.
bool EndsInCrc16(View frame);

/// Returns the sum of all bytes modulo 256 (DCON).
std::uint8_t Sum8(View bytes);

/// Returns the exclusive-or of all bytes (SPA Bus).
std::uint8_t Xor8(View bytes);

}  // namespace baudgate
