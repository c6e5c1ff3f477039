// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/write_log.h"

#include <array>
#include <utility>

namespace baudgate::audit {

std::string_view Name(Kind kind) {
  constexpr std::array<std::string_view, kKinds> kNames = {"point", "route", "denied", "loan"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string Clipped(std::string text) {
  if (text.size() <= kLongestText) return text;
  std::size_t end = kLongestText;
  // Not within a character of UTF-8.
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  text.resize(end);
  return text + "…";
}

std::string_view OutcomeOf(const WriteRecord& record) {
  return record.end ? Name(*record.end) : std::string_view("pending");
}

std::optional<WriteEnd> EndNamed(std::string_view name) {
  for (std::size_t i = 0; i < kWriteEnds; ++i) {
    const auto end = static_cast<WriteEnd>(i);
    if (Name(end) == name) return end;
  }
  return std::nullopt;
}

std::optional<Kind> KindNamed(std::string_view name) {
  for (std::size_t i = 0; i < kKinds; ++i) {
    if (Name(static_cast<Kind>(i)) == name) return static_cast<Kind>(i);
  }
  return std::nullopt;
}

}  // namespace baudgate::audit
