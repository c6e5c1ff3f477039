// Windows-1251 to and from UTF-8: a table for 80 to BF, the Cyrillic alphabet in one run behind it.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/cp1251.h"

#include <algorithm>
#include <array>
#include <iterator>

namespace baudgate::protocols::set4tm {
namespace {

/// Code points of the bytes 80 to BF.
constexpr std::array<char16_t, 64> kUpper = {
    0x0402, 0x0403, 0x201A, 0x0453, 0x201E, 0x2026, 0x2020, 0x2021, 0x20AC, 0x2030, 0x0409,
    0x2039, 0x040A, 0x040C, 0x040B, 0x040F, 0x0452, 0x2018, 0x2019, 0x201C, 0x201D, 0x2022,
    0x2013, 0x2014, 0x003F, 0x2122, 0x0459, 0x203A, 0x045A, 0x045C, 0x045B, 0x045F, 0x00A0,
    0x040E, 0x045E, 0x0408, 0x00A4, 0x0490, 0x00A6, 0x00A7, 0x0401, 0x00A9, 0x0404, 0x00AB,
    0x00AC, 0x00AD, 0x00AE, 0x0407, 0x00B0, 0x00B1, 0x0406, 0x0456, 0x0491, 0x00B5, 0x00B6,
    0x00B7, 0x0451, 0x2116, 0x0454, 0x00BB, 0x0458, 0x0405, 0x0455, 0x0457,
};
constexpr char16_t kAlphabet = 0x0410;  // of byte C0

char16_t ToCodePoint(std::uint8_t byte) {
  if (byte < 0x20 || byte == 0x7F) return u'?';
  if (byte < 0x80) return byte;
  if (byte < 0xC0) return kUpper[byte - 0x80U];
  return static_cast<char16_t>(kAlphabet + (byte - 0xC0));
}

std::uint8_t ToByte(char32_t code) {
  if (code >= 0x20 && code < 0x7F) return static_cast<std::uint8_t>(code);
  if (code >= kAlphabet && code < kAlphabet + 0x40U) {
    return static_cast<std::uint8_t>(0xC0U + (code - kAlphabet));
  }
  const auto* at = std::ranges::find(kUpper, code);
  return at == kUpper.end() ? std::uint8_t{'?'}
                            : static_cast<std::uint8_t>(0x80 + std::distance(kUpper.begin(), at));
}

void AppendUtf8(char16_t code, std::string& text) {
  if (code < 0x80) {
    text += static_cast<char>(code);
    return;
  }
  if (code < 0x800) {
    text += static_cast<char>(0xC0U | (code >> 6U));
  } else {
    text += static_cast<char>(0xE0U | (code >> 12U));
    text += static_cast<char>(0x80U | ((code >> 6U) & 0x3FU));
  }
  text += static_cast<char>(0x80U | (code & 0x3FU));
}

}  // namespace

std::string FromCp1251(View bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    if (byte == 0) break;
    AppendUtf8(ToCodePoint(byte), text);
  }
  const auto last = text.find_last_not_of(' ');
  text.resize(last == std::string::npos ? 0 : last + 1);
  return text;
}

Bytes ToCp1251(std::string_view utf8) {
  Bytes bytes;
  for (std::size_t i = 0; i < utf8.size();) {
    const auto lead = static_cast<std::uint8_t>(utf8[i++]);
    unsigned more = 0;
    char32_t code = lead;
    if (lead >= 0xF0) {
      more = 3;
      code = lead & 0x07U;
    } else if (lead >= 0xE0) {
      more = 2;
      code = lead & 0x0FU;
    } else if (lead >= 0xC0) {
      more = 1;
      code = lead & 0x1FU;
    }
    for (; more > 0 && i < utf8.size(); --more, ++i) {
      code = (code << 6U) | (static_cast<std::uint8_t>(utf8[i]) & 0x3FU);
    }
    bytes.push_back(ToByte(code));
  }
  return bytes;
}

}  // namespace baudgate::protocols::set4tm
