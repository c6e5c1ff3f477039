// SPDX-License-Identifier: Apache-2.0
#include "gateway/writes/interlock.h"

#include "gateway/base/decimal.h"
#include "gateway/base/shown.h"
#include "gateway/store/ageing.h"

namespace baudgate {
namespace {

bool Same(const Value& a, const Value& b) {
  if (std::holds_alternative<std::string>(a) || std::holds_alternative<std::string>(b)) {
    return ToText(a) == ToText(b);
  }
  const auto number = Decimal::Of(a);
  return number && number == Decimal::Of(b);
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

}  // namespace baudgate
