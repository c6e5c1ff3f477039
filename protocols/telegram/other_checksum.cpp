// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/other_checksum.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "protocols/telegram/field.h"

namespace baudgate::protocols::telegram {
namespace {

/// A check value as it was said, and the bytes in front of it.
struct Said {
  View front{};
  std::uint32_t value = 0;
};

std::optional<Said> SaidOf(const Form& form, const Match& match) {
  const auto& elements = form.pattern.elements;
  std::size_t at = 0;
  for (std::size_t i = 0; i < match.parts.size(); at += match.parts[i].size(), ++i) {
    if (!elements[i].is_field() || elements[i].name != kChecksum) continue;
    const Value value = DecodeField(elements[i].format, match.parts[i]);
    const auto* number = std::get_if<std::int64_t>(&value);
    if (number == nullptr || *number < 0) return std::nullopt;
    return Said{View(match.parts[0].data(), at), static_cast<std::uint32_t>(*number)};
  }
  return std::nullopt;
}

std::vector<std::pair<std::size_t, std::size_t>> RangesBeside(const Checksum& own) {
  std::vector<std::pair<std::size_t, std::size_t>> ranges = {{own.skip, own.leave}};
  for (const std::size_t skip : {own.skip, std::size_t{0}, std::size_t{1}}) {
    for (const std::size_t leave : {own.leave, std::size_t{0}, std::size_t{1}}) {
      if (std::ranges::find(ranges, std::pair(skip, leave)) == ranges.end()) {
        ranges.emplace_back(skip, leave);
      }
    }
  }
  return ranges;
}

/// As a profile writes it.
std::string Written(const Checksum& sum, bool range) {
  const std::string kind(sum.kind->name);
  if (!range && sum.skip == 0 && sum.leave == 0) return "checksum: " + kind;
  return "checksum: { kind: " + kind + ", skip: " + std::to_string(sum.skip) +
         ", leave: " + std::to_string(sum.leave) + " }";
}

/// Another of the known ones, over the same bytes; or any of them over others.
std::optional<Checksum> FindFit(const Checksum& own, const Said& said) {
  for (const auto& [skip, leave] : RangesBeside(own)) {
    Checksum sum{own.kind, skip, leave};
    if (sum.Of(said.front) == said.value) return sum;
    for (const ChecksumKind& kind : ChecksumKinds()) {
      sum.kind = &kind;
      if (sum.Of(said.front) == said.value) return sum;
    }
  }
  return std::nullopt;
}

std::string Hex(std::uint32_t value, std::size_t bytes) {
  std::string text;
  while (bytes-- > 0) text += HexByte(static_cast<std::uint8_t>(value >> (8 * bytes)));
  return text;
}

}  // namespace

std::optional<Recognised> OtherChecksum(const Form& form, const Match& match) {
  const auto said = SaidOf(form, match);
  if (!said || form.checksum.kind == nullptr) return std::nullopt;
  const Checksum& own = form.checksum;
  const auto awaited = own.Of(said->front);
  if (!awaited) return std::nullopt;
  if (const auto fit = FindFit(own, *said)) {
    const bool range = fit->skip != own.skip || fit->leave != own.leave;
    return Recognised{Recognised::What::other_check,
                      "its check value is computed otherwise (" + std::string(fit->kind->name) +
                          (range ? " over other characters fits)" : " fits)"),
                      "write " + Written(*fit, range) + " in its profile"};
  }
  const std::string_view kind = own.kind->name;
  const bool adds = kind.starts_with("sum") || kind == "lrc";
  const std::uint32_t difference = adds ? said->value - *awaited : said->value ^ *awaited;
  return Recognised{Recognised::What::other_check, "a text",
                    "it differs from " + std::string(kind) + " always by " +
                        Hex(difference, own.kind->bytes) +
                        ": does the profile fit the firmware of the device?"};
}

}  // namespace baudgate::protocols::telegram
