// Sentences about the points of a device that answers. diagnose.h describes the functions.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "gateway/base/decimal.h"
#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/diagnosis/causes/diagnose.h"
#include "gateway/diagnosis/causes/words.h"

namespace baudgate::diagnosis {
namespace {

using Sentences = std::vector<std::string>;

/// Returns the remedy for values that are not good for this reason; null: no remedy is known.
const char* RemedyFor(Reason reason) {
  switch (reason) {
    case Reason::over_range:
    case Reason::under_range:
      return "check the sensor, its wire and its range (at a balance the load)";
    case Reason::open_sensor:
      return "check the sensor and its wire";
    case Reason::sentinel:
      return "nothing was measured: check what is connected to that input";
    case Reason::no_permission:
      return "the access level is too low: set the password of a higher level at the device";
    case Reason::device_fault:
      return "the device reports a fault: check, restart or replace it";
    case Reason::channel_disabled:
      return "switch these channels on in the device, or take the points out of the profile";
    case Reason::not_ready:
      return "it has not measured since its start: wait, then check the device";
    default:
      return nullptr;
  }
}

/// Returns the configured limit that a reading with this reason may exceed, such as "max" and 100.
/// Nothing: no limit is configured, so the device itself has reported over_range or under_range.
std::optional<std::pair<const char*, Decimal>> LimitOf(const config::Point& point, Reason reason) {
  if (point.access != config::Access::read) return std::nullopt;
  const bool over = reason == Reason::over_range;
  if (!over && reason != Reason::under_range) return std::nullopt;
  const auto& limit = over ? point.writing.max : point.writing.min;
  if (!limit) return std::nullopt;
  return std::pair(over ? "max" : "min", *limit);
}

/// Returns what the reply contained in place of a number, and the remedy.
std::string NoNumber(const Finding& finding) {
  if (!finding.remedy.empty()) return ": " + WithRemedy(finding);
  const std::string& text = finding.cause;
  if (text.empty()) {
    return ": it sends nothing for them. Check that the profile fits the device";
  }
  if (text.find_first_not_of("*- ") == std::string::npos) {
    return ": '" + Shortened(text) + "' means that nothing is measured. Check its inputs and cards";
  }
  const bool comma = ParseDecimal(WithDecimalPoint(text)).has_value();
  return ": '" + Shortened(text) + "' is no number. " +
         (comma ? "Set a decimal point at the device, or type: string in its profile"
                : "Check that the profile fits the device, or set type: string in it");
}

/// Every polled point should have a value after this time, even if its poll period is longer.
constexpr Duration kLongestStart = 1min;
/// A point without a value is not reported before this time since the start.
constexpr Duration kLongWait = 20s;
/// After this many messages, a device that sends unasked should have sent all its values.
constexpr std::size_t kManyMessages = 20;

struct Doubts {
  std::size_t stale = 0;
  std::size_t doubted = 0;   ///< points whose value the gateway itself doubts
  std::size_t reported = 0;  ///< points whose quality the device itself has reported
  // Numbers of reported points without a reason:
  std::size_t unreadable = 0;
  std::size_t unsure = 0;
  /// How many points of `unsure` need a second reading to confirm a jump (recheck).
  std::size_t jumping = 0;
  std::size_t empty = 0;
  std::map<Reason, std::size_t> reasons;
  std::string first;  ///< name of the first reported point
  /// Number of reported points whose readings may be beyond their configured min or max.
  std::size_t limited = 0;
  std::string limit_remedy;  ///< remedy for the first point that `limited` counts

  void AddReported(const Quality& quality, const config::Point& point) {
    ++reported;
    if (first.empty()) first = point.name;
    if (const auto limit = LimitOf(point, quality.reason); limit && ++limited == 1) {
      limit_remedy =
          fmt::format("correct the configured {0} ({1}), or check the sensor and its range",
                      limit->first, limit->second.ToText());
    }
    if (quality.reason != Reason::none) {
      ++reasons[quality.reason];
    } else if (quality == Quality::bad_sensor_failure) {
      ++empty;
    } else {
      ++(IsUncertain(quality) ? unsure : unreadable);
      if (quality == Quality::uncertain && point.recheck != config::Recheck::off) ++jumping;
    }
  }
};

/// True if a missing value is normal: an option is not fitted; or there is nothing to measure at
/// present, while at least one point of the device has a value.
bool IsUsual(const bus::DeviceRecord& record, Reason reason) {
  if (reason == Reason::not_fitted) return LacksOptions(record);
  const auto lacks = [](const bus::PointRecord& point) { return IsBad(point.reported); };
  return (reason == Reason::sentinel || reason == Reason::channel_disabled) &&
         !std::ranges::all_of(record.points, lacks);
}

/// Counts the points that are not good: if `usual`, those whose reason is normal (IsUsual), else
/// the others.
Doubts DoubtsOf(const bus::LineStatus& line, const bus::DeviceRecord& record, Now now, bool usual) {
  // The polls begin when the port opens, or the device is taken into use.
  const Duration open = now.wall - std::max(line.port_since, record.status.disabled_since);
  Doubts doubts;
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    const Quality quality = QualityAt(record, i, now.instant);
    if (IsGood(quality) || quality == Quality::bad_waiting) continue;
    const Duration period = PeriodOf(*record.device, record.device->points[i].group);
    if (open < std::min(period, kLongestStart)) continue;
    const bool reported = quality == record.points[i].reported;
    if (usual != (reported && IsUsual(record, quality.reason))) continue;
    // If the reading itself was good, the value is not good because of doubt or age.
    if (reported) {
      // A reader of cards or codes that has not read anything yet is in order.
      if (record.status.unasked && quality.reason == Reason::not_ready) continue;
      doubts.AddReported(quality, record.device->points[i]);
    } else if (quality == Quality::uncertain && quality == record.points[i].at_best) {
      ++doubts.doubted;
    } else {
      const auto group = static_cast<std::size_t>(record.device->points[i].group);
      const bus::AgeLimits& limits = record.age_limits[group];
      // If the port was opened less than an age limit ago, the point has perhaps not been polled
      // yet.
      const bool waits = limits.ages() && open < limits.uncertain_after;
      if (!waits) ++doubts.stale;
    }
  }
  return doubts;
}

std::string SayStale(const bus::DeviceRecord& record, std::size_t stale, Now now) {
  if (const auto every = ComesEvery(record, now.instant)) {
    return "comes every " + FormatAge(*every) +
           ", and its max_age is shorter. Raise its 'poll' or max_age above this interval, or let "
           "the device send more often";
  }
  if (record.status.unasked && record.status.last_ok) {
    return "nothing has come for " + FormatAge(now.instant - *record.status.last_ok) +
           ", and its max_age is shorter. Check its power and its wire";
  }
  return fmt::format(
      "{} of {} points are older than their max_age, because its polls fail or come too seldom. "
      "Follow the other sentences about it, or raise max_age",
      stale, record.points.size());
}

/// Returns the reasons and the first point, such as "2 over range, 1 open sensor; level, ...".
std::string WhichAre(const Doubts& doubts) {
  std::string text;
  for (const auto& [reason, count] : doubts.reasons) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, Name(reason));
  }
  return text + (text.empty() ? "" : "; ") + doubts.first + (doubts.reported > 1 ? ", ..." : "");
}

/// Returns why readings without a reason are not good. Empty: there is no common explanation.
std::string WhyUnreadable(const bus::DeviceRecord& record, const Doubts& doubts) {
  if (doubts.jumping == doubts.reported && record.status.rechecks > 0) {
    return ": each reading is far from the one before, also when it is read again at once. Look "
           "for noise; if the value really changes so fast, set recheck: off at the point";
  }
  if (doubts.unsure == doubts.reported) {
    return ": the device reports them as uncertain (not stable). Check what it measures";
  }
  const bus::Findings& findings = record.status.findings;
  const bool numbers = findings.Count(Symptom::no_number) > 0;
  if (numbers && doubts.unreadable + doubts.empty == doubts.reported) {
    return NoNumber(findings.Last(Symptom::no_number));
  }
  if (doubts.unreadable == doubts.reported) {
    return ": the device reports them as invalid, or sends them in another format. Check its "
           "sensors";
  }
  if (doubts.empty == doubts.reported) {
    return ": it sends no number for them. Check what it measures (NaN), or look for a decimal "
           "comma with 'baudgate trace'";
  }
  return {};
}

/// Returns the remedy if all reported points have the same reason, or all have a configured limit;
/// else an empty text.
std::string RemedyForAll(const bus::DeviceRecord& record, const Doubts& doubts) {
  if (doubts.limited == doubts.reported) return NextSentence(doubts.limit_remedy);
  if (doubts.reasons.size() != 1 || doubts.reasons.begin()->second != doubts.reported) return {};
  const Reason reason = doubts.reasons.begin()->first;
  const char* const remedy = RemedyFor(reason);
  if (remedy == nullptr) return {};
  const bool inputs = reason != Reason::device_fault && reason != Reason::no_permission;
  const bool all = inputs && doubts.reported == record.points.size() && doubts.reported > 1;
  return all ? ". Nothing is measured: check what is connected to the device"
             : NextSentence(remedy);
}

/// Returns ": " with cause and remedy of the reported points. Empty: the names of the reasons are
/// enough.
std::string WhyReported(const bus::DeviceRecord& record, const Doubts& doubts) {
  std::string why = WhyUnreadable(record, doubts) + RemedyForAll(record, doubts);
  const auto refused = doubts.reasons.find(Reason::not_fitted);
  if (refused == doubts.reasons.end()) return why;
  const std::string said = Brief(record.status.findings.Last(Symptom::refusal));
  why += said.empty() ? ": it does not answer requests for them" : ": it answers '" + said + "'";
  const bool all = refused->second == record.points.size();
  return why + NextSentence(RefusesWhatItGave(record) ? kHasWorked
                            : all                     ? "check that the profile fits the device"
                                  : "correct these points, or take them out of the profile");
}

}  // namespace

std::string NameOf(const bus::DeviceRecord& record) {
  return record.line->name + "." + record.device->name;
}

bool RefusesWhatItGave(const bus::DeviceRecord& record) {
  const auto refused = [](const bus::PointRecord& point) {
    return point.reported.reason == Reason::not_fitted;
  };
  const auto never_given = [&](const bus::PointRecord& point) {
    return refused(point) && !HasValue(point.value);
  };
  return std::ranges::any_of(record.points, refused) &&
         std::ranges::none_of(record.points, never_given);
}

bool LacksOptions(const bus::DeviceRecord& record) {
  const auto is_refused = [](const bus::PointRecord& point) {
    return point.reported.reason == Reason::not_fitted && !HasValue(point.value);
  };
  const auto refused = std::ranges::count_if(record.points, is_refused);
  return refused > 0 && 2 * refused <= std::ssize(record.points) && !RefusesWhatItGave(record);
}

bool IsForeign(const bus::DeviceRecord& record) {
  return record.override_quality && ConcernsDevice(record.override_quality->reason);
}

Sentences DiagnosePoints(const bus::LineStatus& line, const bus::DeviceRecord& record, Now now) {
  if (IsForeign(record)) return {};  // a sentence about the device explains all values
  const Doubts doubts = DoubtsOf(line, record, now, false);
  const std::size_t points = record.points.size();
  Sentences found;
  if (doubts.stale > 0) found.push_back(SayStale(record, doubts.stale, now));
  if (doubts.doubted > 0) {
    found.push_back(
        fmt::format("{} of {} points are uncertain until the next read, because the port was "
                    "reopened, the device was away, or a reply may belong to another request",
                    doubts.doubted, points));
  }
  if (doubts.reported > 0) {
    found.push_back(fmt::format("{} of {} points have no good value ({}){}", doubts.reported,
                                points, WhichAre(doubts), WhyReported(record, doubts)));
  }
  if (now.wall - line.port_since < record.device->poll) return found;
  if (std::string off = OffByOne(record); !off.empty()) found.push_back(std::move(off));
  for (std::string& sentence : AbsurdNumbers(record, now)) found.push_back(std::move(sentence));
  return found;
}

Sentences NoteAbsent(const bus::LineStatus& line, const bus::DeviceRecord& record, Now now) {
  const Doubts doubts = DoubtsOf(line, record, now, true);
  if (IsForeign(record) || doubts.reported == 0 || !OffByOne(record).empty()) return {};
  const std::string said = Brief(record.status.findings.Last(Symptom::refusal));
  return {fmt::format(
      "note: {} of {} points have no value ({}), which is usual {}", doubts.reported,
      record.points.size(), WhichAre(doubts),
      doubts.reasons.contains(Reason::not_fitted)
          ? "if the device lacks them" + (said.empty() ? "" : " (it answers '" + said + "')") +
                ". Take these points out of the profile, or correct them"
          : "where nothing is measured (a motor at rest, a direction that is not used)")};
}

Sentences DiagnoseWaiting(const bus::DeviceRecord& record, Now now, Instant started) {
  std::size_t waiting = 0;
  std::string first;
  const bus::Findings& findings = record.status.findings;
  const Finding& odd = findings.Last(Symptom::odd);
  const Finding& said = odd.cause.empty() ? findings.Last(Symptom::refusal) : odd;
  // If the device has refused a request, points of the slow group count as well: they have been
  // polled by now.
  const config::Group least = said.cause.empty() ? config::Group::fast : config::Group::slow;
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    const config::Point& point = record.device->points[i];
    const bool polled = point.group >= least && point.access != config::Access::write;
    if (!polled || QualityAt(record, i, now.instant) != Quality::bad_waiting) continue;
    ++waiting;
    if (first.empty()) first = point.name;
  }
  const Duration patience = std::max<Duration>(kLongWait, 3 * record.device->poll);
  if (waiting == 0 || now.instant - started < patience) return {};
  if (record.status.unasked && said.cause.empty()) {
    // A device that sends unasked: in many messages none contained these values.
    if (findings.size() < kManyMessages || !MustSpeakWithin(record)) return {};
    const std::string& missing = record.status.missing;
    return {fmt::format("{} of {} points have no value yet ({}{}): {}", waiting,
                        record.points.size(), first, waiting > 1 ? ", ..." : "",
                        missing.empty()
                            ? "none of its messages contains them. Check that the profile fits the "
                              "device, and that its parameters (unit) are right"
                            : missing)};
  }
  return {fmt::format(
      "{} of {} points have no value yet ({}{}): {}{}", waiting, record.points.size(), first,
      waiting > 1 ? ", ..." : "",
      said.cause.empty() ? "the device does not give them" : "it answers '" + Brief(said) + "'",
      NextSentence(RemedyOf(said)))};
}

namespace {

/// Numbers that are smaller (except 0) or larger than this cannot be measurements.
constexpr double kLeastMeasured = 1e-20;
constexpr double kMostMeasured = 1e20;
/// Most measurements are in this range.
constexpr double kLeastUsual = 1e-4;
constexpr double kMostUsual = 1e7;
/// If another number of the device is at most this large, an unsigned number this close to its
/// maximum is probably a negative number.
constexpr double kSmall = 1000;
/// Registers are neighbours if their numbers differ by at most this.
constexpr int kNextTo = 4;

/// Table and number of a register, such as "holding " and 40.
using Register = std::pair<std::string, int>;

struct Float {
  std::optional<Register> place;
  std::uint32_t bits;
};

std::optional<Register> RegisterOf(const config::Point& point) {
  const std::size_t end = point.read.find_last_not_of("0123456789") + 1;
  const auto number = ParseInteger<int>(std::string_view(point.read).substr(end));
  return number ? std::optional(Register(point.read.substr(0, end), *number)) : std::nullopt;
}

bool IsUsual(std::uint32_t bits) {
  const double size = std::abs(std::bit_cast<float>(bits));
  return size == 0 || (size >= kLeastUsual && size <= kMostUsual);
}

/// Returns the byte order that is configured for the device. Empty: none, or the default (abcd).
std::string SetOrder(const config::Device& device) {
  const auto order = device.options.all().find("order");
  if (!device.traits->has_byte_order || order == device.options.all().end()) return {};
  const auto* const name = std::get_if<std::string>(&order->second);
  return name == nullptr || *name == Name(config::WordOrder::abcd) ? std::string() : *name;
}

/// Returns the byte order in which all these numbers look usual. Empty: no byte order does, or more
/// than one; or the device has no such option, or it is set already.
std::string OrderOf(const config::Device& device, const std::vector<Float>& numbers) {
  using enum config::WordOrder;
  if (!device.traits->has_byte_order || !SetOrder(device).empty()) return {};
  std::string_view found;
  for (const config::WordOrder one : {cdab, badc, dcba}) {
    const std::string_view other = Name(one);
    const bool all = std::ranges::all_of(numbers, [&](const Float& number) {
      std::uint32_t turned = 0;
      for (const char place : other) {
        const int byte = place - 'A';  // 0: the first of the four bytes in the reply
        turned = turned << 8U | (number.bits >> (8U * (3U - static_cast<unsigned>(byte))) & 0xFFU);
      }
      return IsUsual(turned);
    });
    if (!all) continue;
    if (!found.empty()) return {};
    found = other;
  }
  return std::string(found);
}

/// True if the numbers were read at addresses shifted by one register: the second half of each
/// number and the first half of the next make a usual number. Swapped words look the same, unless
/// the last word is 0.
bool AreShifted(const std::vector<Float>& numbers) {
  bool any = false;
  for (const Float& number : numbers) {
    const auto next = std::ranges::find_if(numbers, [&](const Float& other) {
      return number.place && other.place && other.place->first == number.place->first &&
             other.place->second == number.place->second + 2;
    });
    if (next == numbers.end()) continue;
    const std::uint32_t joined = number.bits << 16U | next->bits >> 16U;
    if (joined == 0 || !IsUsual(joined)) return false;
    any = true;
  }
  return any;
}

/// Returns why an integer cannot be a measurement; empty: it can be a measurement. `small`: at
/// least one number of the device is small (kSmall).
std::string WhyImpossible(const config::Point& point, double raw, bool small) {
  using enum config::Type;
  const bool is_signed = point.type == int16 || point.type == int32;
  const bool is_short = point.type == int16 || point.type == uint16;
  if (!is_short && !is_signed && point.type != uint32) return {};
  const double values = is_short ? 0x1p16 : 0x1p32;
  const bool ones = !is_signed && raw == values - 1 && (!is_short || !point.unit.empty());
  if (raw == values / 2 - 1 || (is_signed && raw == -values / 2) || ones) {
    return "this number is a code, not a measurement: check what is measured, and add the number "
           "to "
           "'sentinels' of the point";
  }
  if (is_signed || raw < values - kSmall || raw == values - 1 || !small) return {};
  return fmt::format("as a signed number it is {:.0f}: set type: {} in the profile", raw - values,
                     is_short ? "int16" : "int32");
}

}  // namespace

std::string OffByOne(const bus::DeviceRecord& record, std::size_t least) {
  std::map<std::string, std::map<int, std::size_t>> rows;
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    if (const auto place = RegisterOf(record.device->points[i]))
      rows[place->first][place->second] = i;
  }
  const auto is_refused = [&](const auto& entry) {
    const bus::PointRecord& point = record.points[entry.second];
    return point.reported.reason == Reason::not_fitted && !HasValue(point.value);
  };
  for (const auto& [kind, row] : rows) {
    if (row.size() < least || std::ranges::count_if(row, is_refused) != 1) continue;
    const bool last = is_refused(*row.rbegin());
    if (!last && !is_refused(*row.begin())) continue;
    const auto end = last ? std::prev(row.end()) : row.begin();
    const auto next = last ? std::prev(end) : std::next(end);
    if (std::abs(next->first - end->first) > kNextTo) continue;
    const config::Point& point = record.device->points[end->second];
    return fmt::format(
        "only the {} address is refused ({}, {}), so all addresses are off by one. {} each address "
        "by one in the profile",
        last ? "last" : "first", point.name, point.read, last ? "Lower" : "Raise");
  }
  return {};
}

std::vector<std::string> AbsurdNumbers(const bus::DeviceRecord& record, Now now) {
  struct Number {
    const config::Point& point;
    double shown;
    double raw;
  };
  std::vector<Number> numbers;
  std::vector<Float> floats;
  bool small = false;
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    const config::Point& point = record.device->points[i];
    const double shown = ToDouble(record.points[i].value);
    const double raw = (shown - point.offset.ToDouble()) / point.scale.ToDouble();
    if (point.type == config::Type::boolean || !std::isfinite(raw)) continue;
    if (!IsGood(QualityAt(record, i, now.instant))) continue;
    numbers.push_back({point, shown, raw});
    small = small || std::abs(raw) <= kSmall;
    if (point.type != config::Type::float32) continue;
    floats.push_back({RegisterOf(point), std::bit_cast<std::uint32_t>(static_cast<float>(raw))});
  }
  std::size_t absurd = 0;
  std::string first;
  std::string why;  // why the first impossible number cannot be true; empty for a float
  for (const auto& [point, shown, raw] : numbers) {
    const double size = std::abs(shown);
    const bool is_float =
        point.type == config::Type::float32 || point.type == config::Type::float64;
    const std::string impossible = WhyImpossible(point, raw, small);
    const bool fits = !is_float || size == 0 || (size >= kLeastMeasured && size <= kMostMeasured);
    if (impossible.empty() && fits) continue;
    if (++absurd > 1) continue;
    first = fmt::format("{}: {:.{}g}", point.name, shown, is_float ? 3 : 10);
    why = impossible;
  }
  if (absurd == 0 || (why.empty() && !OffByOne(record, 2).empty())) return {};
  const std::string order = OrderOf(*record.device, floats);
  const bool shifted = AreShifted(floats);
  const std::string set = SetOrder(*record.device);
  const bool either = shifted && floats.back().bits != 0 && (!order.empty() || !set.empty());
  if (why.empty() && either) {
    // Either remedy makes the numbers look right, but only one is correct.
    why = (order.empty() ? "remove order: " + set + " from the configuration"
                         : "set order: " + order) +
          ", or correct their addresses by one register; compare with its display, because either "
          "change gives plausible numbers";
  } else if (why.empty()) {
    why = shifted
              ? "correct their addresses: one register lower (or higher) gives plausible numbers"
          : order.empty()
              ? "check the order of their bytes (order), their type and their register"
              : "set order: " + order + " in the configuration, as their bytes come in that order";
  }
  return {fmt::format("{} of {} numbers cannot be true ({}{}){}", absurd, numbers.size(), first,
                      absurd > 1 ? ", ..." : "", NextSentence(why))};
}

}  // namespace baudgate::diagnosis
