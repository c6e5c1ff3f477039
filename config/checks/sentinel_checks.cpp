// SPDX-License-Identifier: Apache-2.0
#include "config/checks/sentinel_checks.h"

#include <cmath>
#include <string>

#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

using Kind = RawNumbers::Kind;

/// 0x8000 of 16 bits with a sign: -32768.
Decimal OfBits(const Decimal& number, const IntegerRange& range) {
  const Decimal meant = number - range.highest - range.highest - 2;
  return range.lowest < 0 && number > range.highest && meant.is_negative() ? meant : number;
}

bool IsHex(const Sentinel& sentinel) {
  return sentinel.written.substr(0, 2).find_first_of("xX") == 1;
}

/// Empty: it may come. The sentence goes on behind the number.
std::string WhyNever(const Sentinel& sentinel, const RawNumbers& numbers) {
  const bool is_real = numbers.kind == Kind::single || numbers.kind == Kind::real;
  if (is_real && IsHex(sentinel)) {
    return "is in hex, which is for whole numbers, and a float is read; write the number itself, "
           "such as -999.9 or 1e30";
  }
  if (numbers.Contain(sentinel.value)) return {};
  if (numbers.kind == Kind::single) {
    const double nearest = NearestSingle(sentinel.value.ToDouble());
    return "is no float32, which is what is read" +
           (std::isfinite(nearest) ? "; the nearest is " + FormatNumber(nearest) : std::string());
  }
  const auto& [lowest, highest] = numbers.range;
  const Decimal meant = OfBits(sentinel.value, numbers.range);
  return "is never read: these are whole numbers " + std::to_string(lowest) + "…" +
         std::to_string(highest) + ", before scale and offset" +
         (numbers.Contain(meant) ? "; write " + meant.ToText() : "");
}

void Resolve(Point& point, const RawNumbers& numbers, Problems& problems) {
  const IntegerRange& range = numbers.range;
  // Digits of a text have no bits of their own.
  const bool has_bits =
      numbers.kind == Kind::whole && (range.lowest == 0 || Decimal(range.highest).ToInt64());
  const IntegerRange bits = has_bits ? range : RangeOf(point.type);
  for (std::size_t i = 0; i < point.sentinels.size(); ++i) {
    Sentinel& sentinel = point.sentinels[i];
    if (IsHex(sentinel)) sentinel.value = OfBits(sentinel.value, bits);
    std::string why = WhyNever(sentinel, numbers);
    for (std::size_t other = 0; other < i && why.empty(); ++other) {
      if (point.sentinels[other].value == sentinel.value) why = "stands twice";
    }
    if (!why.empty()) problems.Error(sentinel.mark, "sentinels: " + sentinel.written + " " + why);
  }
}

}  // namespace

void ResolveSentinels(Device& device, const Protocol* protocol, Problems& problems) {
  const bool asks = protocol != nullptr && protocol->raw_numbers != nullptr;
  for (Point& point : device.points) {
    if (point.sentinels.empty() || point.type == Type::string) continue;
    Resolve(point, asks ? protocol->raw_numbers(device, point) : RawNumbers(), problems);
  }
}

}  // namespace baudgate::config
