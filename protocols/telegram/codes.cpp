// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/codes.h"

#include <array>

#include "gateway/base/text.h"
#include "protocols/telegram/field.h"

namespace baudgate::protocols::telegram {
namespace {

constexpr std::array<Meaning, 10> kMeanings = {
    {{"good", Quality::good},
     {"uncertain", Quality::uncertain},
     {"busy", {Quality::bad, Reason::not_ready}, true},
     {"over", {Quality::bad_sensor_failure, Reason::over_range}},
     {"under", {Quality::bad_sensor_failure, Reason::under_range}},
     {"open", {Quality::bad_sensor_failure, Reason::open_sensor}},
     {"disabled", {Quality::bad_out_of_service, Reason::channel_disabled}},
     {"not_ready", {Quality::bad, Reason::not_ready}},
     {"fault", {Quality::bad_device_failure, Reason::device_fault}},
     {"bad", Quality::bad}}};

}  // namespace

std::span<const Meaning> Meanings() { return kMeanings; }

const Meaning* FindCode(const Codes& codes, const Format& format, View bytes, const Value& value) {
  if (codes.empty()) return nullptr;
  if (format.is_binary() || format.kind == Format::Kind::scientific) {
    Format any;
    any.kind = Format::Kind::scientific;
    for (const auto& [code, meaning] : codes) {
      const Value number = DecodeField(any, ToBytes(code));
      if (HasValue(value) && SameValue(HasValue(number) ? number : Value(code), value)) {
        return meaning;
      }
    }
    if (format.is_binary()) return nullptr;
  }
  if (format.kind == Format::Kind::byte) {
    const auto found = codes.find(ByteText(bytes));
    return found == codes.end() ? nullptr : found->second;
  }
  const std::string_view text = AsText(bytes);
  const auto found = codes.find(format.kind == Format::Kind::character ? text : Trim(text));
  return found == codes.end() ? nullptr : found->second;
}

}  // namespace baudgate::protocols::telegram
