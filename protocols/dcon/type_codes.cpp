// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/type_codes.h"

#include <algorithm>
#include <array>
#include <string>

#include "gateway/base/spelling.h"

namespace baudgate::protocols::dcon {
namespace {

struct Spelling {
  std::string_view text;  ///< in lower case, without blanks
  std::string_view unit;
};

constexpr std::array<Spelling, 10> kSpellings = {{{"v", "V"},
                                                  {"volt", "V"},
                                                  {"volts", "V"},
                                                  {"mv", "mV"},
                                                  {"ma", "mA"},
                                                  {"c", "degC"},
                                                  {"°c", "degC"},
                                                  {"degc", "degC"},
                                                  {"celsius", "degC"},
                                                  {"hz", "Hz"}}};

}  // namespace

std::string_view UnitOfType(std::uint8_t type) {
  switch (type) {
    case 0x00:
    case 0x01:
    case 0x02:
    case 0x03:
    case 0x0B:
    case 0x0C:
      return "mV";
    case 0x04:
    case 0x05:
    case 0x08:
    case 0x09:
    case 0x0A:
      return "V";
    case 0x06:
    case 0x07:
    case 0x0D:
    case 0x1A:
      return "mA";
    default:
      return (type >= 0x0E && type <= 0x19) || (type >= 0x20 && type <= 0x2D) ? "degC" : "";
  }
}

bool IsAnalogOutput(std::uint8_t type) { return (type >= 0x30 && type <= 0x35) || type == 0x3F; }

std::string_view PlainUnit(std::string_view unit) {
  std::string text = config::Lower(unit);
  std::erase(text, ' ');
  const auto found = std::ranges::find(kSpellings, text, &Spelling::text);
  return found == kSpellings.end() ? unit : found->unit;
}

bool IsUnitOfTypes(std::string_view unit) {
  const std::string_view plain = PlainUnit(unit);
  return plain == "V" || plain == "mV" || plain == "mA" || plain == "degC";
}

std::optional<double> FactorOfType(std::uint8_t type, std::string_view unit) {
  const std::string_view own = UnitOfType(type);
  const std::string_view wanted = PlainUnit(unit);
  if (own.empty() || !IsUnitOfTypes(unit) || own == wanted) return 1;
  if (own == "mV" && wanted == "V") return 0.001;
  if (own == "V" && wanted == "mV") return 1000;
  return std::nullopt;
}

}  // namespace baudgate::protocols::dcon
