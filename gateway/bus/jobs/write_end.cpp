// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/write_end.h"

#include <algorithm>

#include "gateway/bus/points/conversion.h"

namespace baudgate {
namespace {

/// Significant digits of a number that a device takes and shows.
constexpr int kDigits = 3;

/// How far what is shown may be from what was written.
Decimal Tolerance(const config::Point& point, const Decimal& written) {
  Decimal tolerance = Abs(written).Shifted(-kDigits);
  if (point.writing.step) tolerance = std::max(tolerance, *point.writing.step / 2);
  if (point.writing.decimals) {
    tolerance = std::max(tolerance, Abs(point.scale).Shifted(-*point.writing.decimals) / 2);
  }
  return tolerance;
}

}  // namespace

WriteEnd WriteEndOf(Outcome outcome, bool sent, bool may_have_acted) {
  switch (outcome) {
    case Outcome::ok:
      return sent ? WriteEnd::ok : WriteEnd::not_sent;
    case Outcome::refused:
      return may_have_acted ? WriteEnd::unknown : WriteEnd::refused;
    case Outcome::unsupported:
      return WriteEnd::refused;
    case Outcome::busy:
      return WriteEnd::busy;
    default:
      return EndUnheard(sent);
  }
}

Value WrittenValue(const config::Point& point, const PointWrite& write) {
  return ToSample(point, {write.point, write.raw}).value;
}

Shown Compare(const config::Point& point, const PointWrite& write, const Value& shown) {
  if (!HasValue(shown)) return Shown::nothing;
  const Value wanted = WrittenValue(point, write);
  const bool is_float = point.type == config::Type::float32 || point.type == config::Type::float64;
  const bool scaled = point.scale != 1 || point.offset != 0;
  if (!is_float && !scaled)
    return ToText(shown) == ToText(wanted) ? Shown::written : Shown::another;
  const auto written = Decimal::Of(wanted);
  const auto now = Decimal::Of(shown);
  if (!written || !now) return Shown::another;
  if (Abs(*now - *written) <= Tolerance(point, *written)) return Shown::written;
  const auto before = Decimal::Of(write.before);
  const bool on_its_way =
      before && std::min(*before, *written) < *now && *now < std::max(*before, *written);
  return on_its_way ? Shown::between : Shown::another;
}

ReadBackVerdict VerdictOn(const WriteQueue::Confirmed& one, const DeviceRecord& record) {
  ReadBackVerdict verdict{{.read_back = !one.replaced, .written = one.written}};
  WriteResult& result = verdict.result;
  const auto is_read = [&](std::uint32_t point) {
    const PointRecord& shown = record.points[point];
    return shown.read_at && *shown.read_at > one.at && shown.at_best == Quality::good;
  };
  for (const PointWrite& write : one.command.writes()) {
    const config::Point& point = record.device->points[write.point];
    const PointRecord& shown = record.points[write.point];
    const bool read = is_read(write.point) && IsGood(shown.reported);
    if (!read) result.read_back = false;
    verdict.lost = verdict.lost || (!read && point.access != config::Access::write);
    const Shown what = read ? Compare(point, write, shown.value) : Shown::nothing;
    if (what != Shown::written) result.read_back = false;
    // It may be on its way, or the device may have limited it: that is not known yet.
    if (what == Shown::between) result.reason = point.name + " shows " + ToText(shown.value);
    if (what != Shown::another) continue;
    const std::string before = result.end == WriteEnd::differs ? result.reason + "; " : "";
    result.end = WriteEnd::differs;
    result.reason = before + point.name + " shows " + ToText(shown.value) + " after " +
                    ToText(WrittenValue(point, write)) + " was written and confirmed";
  }
  if (!std::ranges::all_of(one.command.reads(), is_read)) {
    result.read_back = false;
    result.reason = "not all was answered";
  }
  return verdict;
}

}  // namespace baudgate
