// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/types.h"

#include "gateway/base/text.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr StatusWord kUnknown = StatusWord::unknown;
constexpr Knows kNo = Knows::no;
constexpr Knows kYes = Knows::yes;
constexpr Knows kPerhaps = Knows::perhaps;

// Codes and names: reference 9.3. Floats: 9.7, "SET-4TM.02 and older: integers only". Masks: 9.8,
// from firmware 02.28.30 of .03 and 32.00.00 of PSCH, and M models.
constexpr MeterType kTypes[] = {
    {0x0, "SET-4TM.02, SET-1M.01", kUnknown, kNo, kNo},
    {0x1, "SET-4TM.03", kUnknown, kYes, kPerhaps},
    {0x2, "SEB-1TM.01, .02", kUnknown, kNo, kNo},
    {0x3, "PSCH-4TM.05", kUnknown, kYes, kPerhaps},
    {0x4, "SEO-1.16", kUnknown, kNo, kNo},
    {0x5, "PSCH-3TM.05", kUnknown, kYes, kPerhaps},
    {0x6, "PSCH-4TM.05M", kUnknown, kYes, kYes},
    {0x7, "PSCH-3TM.05M", kUnknown, kYes, kYes},
    {0x8, "SET-4TM.02M, .03M", StatusWord::as_02m_03m, kYes, kYes},
    {0x9, "SEB-1TM.02D", kUnknown, kPerhaps, kPerhaps},
    {0xA, "PSCH-3/4TM.05D", kUnknown, kPerhaps, kPerhaps},
    {0xB, "PSCH-3/4TM.05MK", kUnknown, kPerhaps, kPerhaps},
};

}  // namespace

const MeterType* FindType(std::uint8_t code) {
  for (const MeterType& type : kTypes) {
    if (type.code == code) return &type;
  }
  return nullptr;
}

std::string NameOfType(std::uint8_t code) {
  const std::string digit(1, "0123456789ABCDEF"[code & 0x0FU]);
  const MeterType* type = FindType(code);
  return type == nullptr ? digit : digit + " (" + std::string(type->name) + ")";
}

std::optional<std::uint8_t> ParseType(std::string_view text) {
  if (text.starts_with("0x")) text.remove_prefix(2);
  const auto code = ParseInteger<std::uint8_t>(text, 16);
  return code && *code <= 0x0F ? code : std::nullopt;
}

}  // namespace baudgate::protocols::set4tm
