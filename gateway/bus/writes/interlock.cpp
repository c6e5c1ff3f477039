// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/writes/interlock.h"

#include <algorithm>

#include "gateway/base/decimal.h"
#include "gateway/base/shown.h"
#include "gateway/bus/points/ageing.h"
#include "gateway/bus/writes/write_limits.h"

namespace baudgate {
namespace {

bool Same(const Value& a, const Value& b) {
  if (std::holds_alternative<std::string>(a) || std::holds_alternative<std::string>(b)) {
    return ToText(a) == ToText(b);
  }
  const auto number = Decimal::Of(b);
  return number && IsMeant(a, *number);
}

}  // namespace

std::optional<std::string> WhyLocked(const PointStore& store, const config::Point& point,
                                     const Value& written, Instant now) {
  for (const config::AllowWhen& interlock : point.writing.allow_when) {
    if (HasValue(interlock.only) && !Same(written, interlock.only)) continue;
    Value value;
    Quality quality;
    store.Read(interlock.device, [&](const DeviceRecord& record) {
      value = record.points[interlock.index].value;
      quality = QualityAt(record, interlock.index, now);
    });
    if (IsGood(quality) && Same(value, interlock.is)) continue;
    const std::string is =
        IsGood(quality) ? "is " + ToText(value) : "is " + std::string(Name(quality));
    return "'" + point.name + "': interlock: " + interlock.point + " " + is + ", but must be " +
           ToText(interlock.is);
  }
  return std::nullopt;
}

std::optional<Beyond> WhyBeyond(const PointStore& store, std::uint32_t device,
                                const config::Point& point, const Value& value, Instant now) {
  const auto number = Decimal::Of(value);
  const auto judge = [&](const std::string& name, bool is_max) -> std::optional<Beyond> {
    if (name.empty()) return std::nullopt;
    const std::string what = is_max ? "maximum" : "minimum";
    const auto& points = store.device(device).points;
    const auto found = std::ranges::find(points, name, &config::Point::name);
    std::optional<Decimal> limit;
    Quality quality = Quality::bad_configuration;
    store.Read(device, [&](const DeviceRecord& record) {
      if (found == points.end()) return;
      const auto index = static_cast<std::size_t>(found - points.begin());
      quality = QualityAt(record, index, now);
      limit = Decimal::Of(record.points[index].value);
    });
    if (!limit || !IsGood(quality)) {
      return Beyond{false, "'" + point.name + "': its " + what + " is not known: " + name + " is " +
                               Name(quality)};
    }
    if (!number || (is_max ? *number <= *limit : *number >= *limit)) return std::nullopt;
    return Beyond{true, "'" + point.name + "': " + number->ToText() + " is " +
                            (is_max ? "above" : "below") + " the " + what + ", " +
                            WithUnit(point, *limit) + " (" + name + ")"};
  };
  auto beyond = judge(*point.writing.max_point, true);
  return beyond ? beyond : judge(*point.writing.min_point, false);
}

bool IsGuarded(const config::Point& point) {
  return !point.writing.allow_when.empty() || point.writing.min_point || point.writing.max_point;
}

}  // namespace baudgate
