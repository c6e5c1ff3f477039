// SPDX-License-Identifier: Apache-2.0
#include "protocols/reader/values.h"

#include <algorithm>

#include "gateway/base/text.h"

namespace baudgate::protocols::reader {
namespace {

constexpr std::string_view kDigits = "0123456789";

Value Word(std::string_view tag, unsigned shift) {
  const std::uint64_t bits = ParseInteger<std::uint64_t>(tag, 16).value_or(0);
  return static_cast<std::int64_t>((bits >> shift) & 0xFFFFU);
}

}  // namespace

Decoded ValueOf(const Item& item, const Tag& tag) {
  using Kind = Item::Kind;
  switch (item.kind) {
    case Kind::high:
      return {Word(tag.text, 32), Quality::good};
    case Kind::middle:
      return {Word(tag.text, 16), Quality::good};
    case Kind::low:
      return {Word(tag.text, 0), Quality::good};
    case Kind::counter:
      return {static_cast<std::int64_t>(tag.counter), Quality::good};
    case Kind::time:
      return {
          std::int64_t{
              std::chrono::floor<std::chrono::seconds>(tag.received.time_since_epoch()).count()},
          Quality::good};
    default:
      return {tag.text, Quality::good};
  }
}

Decoded NumberIn(const Item& item, std::string_view text) {
  const Decoded none{{}, {Quality::bad_sensor_failure}};
  if (item.first > 0) {
    if (item.first > text.size()) return none;
    text = text.substr(item.first - 1, item.last - item.first + 1);
  }
  const std::size_t first = text.find_first_of(kDigits);
  if (first == std::string_view::npos) return none;
  const std::size_t end = std::min(text.find_first_not_of("0123456789.", first), text.size());
  if (text.find_first_of(kDigits, end) != std::string_view::npos)
    return none;  // which one is meant?
  const auto number = ParseDecimal(text.substr(first, end - first));
  if (!number) return none;
  const std::size_t before = text.substr(0, first).find_last_not_of(' ');
  const bool negative = before != std::string_view::npos && text[before] == '-';
  return {negative ? -*number : *number, Quality::good};
}

}  // namespace baudgate::protocols::reader
