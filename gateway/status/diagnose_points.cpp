// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/diagnose_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <variant>
#include <vector>

#include "gateway/base/decimal_comma.h"
#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/status/diagnose_unasked.h"
#include "gateway/status/reason.h"
#include "gateway/status/words.h"

namespace baudgate::control {
namespace {

using Sentences = std::vector<std::string>;

/// What to do where a value is not good for one reason.
const char* RemedyFor(Reason reason) {
  switch (reason) {
    case Reason::over_range:
    case Reason::under_range:
      return "look at the sensor, its wire and its range (a balance: its load)";
    case Reason::open_sensor:
      return "look at the sensor and its wire";
    case Reason::sentinel:
      return "no measurement: look at what is connected to that input";
    case Reason::no_permission:
      return "its access level is too low for them: set the password of a higher one at the device";
    case Reason::device_fault:
      return "a fault of its own: look at it, restart or replace it";
    case Reason::channel_disabled:
      return "switch them on in the device, or take these points out of the profile";
    case Reason::not_ready:
      return "it has measured nothing there since its start, or not yet: wait, then look at it";
    default:
      return nullptr;
  }
}

/// What stands where a number belongs.
std::string NoNumber(const Finding& finding) {
  if (!finding.remedy.empty()) return ": " + WithRemedy(finding);
  const std::string& text = finding.cause;
  if (text.empty()) return ": it sends nothing for them: does the profile fit the device?";
  if (text.find_first_not_of("*- ") == std::string::npos) {
    return ": '" + Shortened(text) + "' stands for no measurement: look at its inputs and cards";
  }
  const bool comma = ParseDecimal(WithDecimalPoint(text)).has_value();
  return ": '" + Shortened(text) + "' is no number: " +
         (comma ? "set a decimal point at the device, or type: string in its profile"
                : "does the profile fit the device? type: string takes it");
}

/// No device measures less, apart from nothing at all, or more.
constexpr double kLeastMeasured = 1e-20;
constexpr double kMostMeasured = 1e20;

/// So much do most devices measure.
constexpr double kLeastUsual = 1e-4;
constexpr double kMostUsual = 1e7;

bool IsUsual(double number) {
  const double size = std::abs(number);
  return size == 0 || (size >= kLeastUsual && size <= kMostUsual);
}

/// The order of bytes in which all of these numbers of four bytes are usual ones. Empty: none, more
/// than one, or the device has no such setting, or another one than the first.
std::string OrderOf(const config::Device& device, const std::vector<double>& numbers) {
  using enum config::WordOrder;
  const auto order = device.options.all().find("order");
  const bool first = order == device.options.all().end() ||
                     order->second == config::OptionValue(std::string(Name(abcd)));
  if (!device.traits->has_byte_order || !first) return {};
  std::string_view found;
  for (const config::WordOrder one : {cdab, badc, dcba}) {
    const std::string_view other = Name(one);
    const bool all = std::ranges::all_of(numbers, [&](double number) {
      const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(number));
      std::uint32_t turned = 0;
      for (const char place : other) {
        const int byte = place - 'A';  // 0: the first of the four, as they came
        turned = turned << 8U | (bits >> (8U * (3U - static_cast<unsigned>(byte))) & 0xFFU);
      }
      return IsUsual(std::bit_cast<float>(turned));
    });
    if (!all) continue;
    if (!found.empty()) return {};
    found = other;
  }
  return std::string(found);
}

/// Numbers such as bytes in another order make.
Sentences AbsurdNumbers(const DeviceRecord& record, Now now) {
  std::size_t numbers = 0;
  std::size_t absurd = 0;
  std::string first;
  std::vector<double> floats;  // of four bytes, as they were read
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    const config::Point& point = record.device->points[i];
    const auto* const number = std::get_if<double>(&record.points[i].value);
    const bool is_float =
        point.type == config::Type::float32 || point.type == config::Type::float64;
    if (!is_float || number == nullptr || !IsGood(QualityAt(record, i, now.instant))) continue;
    ++numbers;
    if (point.type == config::Type::float32 && point.scale == 1 && point.offset == 0) {
      floats.push_back(*number);
    }
    const double size = std::abs(*number);
    if (size == 0 || (size >= kLeastMeasured && size <= kMostMeasured)) continue;
    ++absurd;
    if (first.empty()) first = fmt::format("{}: {:.3g}", point.name, *number);
  }
  if (absurd == 0) return {};
  const std::string order = OrderOf(*record.device, floats);
  return {fmt::format(
      "{} of {} numbers cannot be true ({}{}): {}", absurd, numbers, first,
      absurd > 1 ? ", ..." : "",
      order.empty() ? "check the order of their bytes (order), their type and their register"
                    : "their bytes come in another order: set order: " + order + " at the device")};
}

/// A point that is polled has a value by then.
constexpr Duration kLongWait = 20s;
/// By then a device that speaks by itself has said all that it has to say.
constexpr std::size_t kManyMessages = 20;

}  // namespace

std::string NameOf(const DeviceRecord& record) {
  return record.line->name + "." + record.device->name;
}

bool RefusesWhatItGave(const DeviceRecord& record) {
  const auto refused = [](const PointRecord& point) {
    return point.reported.reason == Reason::not_fitted;
  };
  const auto never_given = [&](const PointRecord& point) {
    return refused(point) && !HasValue(point.value);
  };
  return std::ranges::any_of(record.points, refused) &&
         std::ranges::none_of(record.points, never_given);
}

bool IsForeign(const DeviceRecord& record) {
  return record.override_quality && ConcernsDevice(record.override_quality->reason);
}

Sentences DiagnosePoints(const LineStatus& line, const DeviceRecord& record, Now now) {
  if (IsForeign(record)) return {};  // that explains them all
  const Duration open = now.wall - line.port_since;
  std::size_t stale = 0;
  std::size_t doubted = 0;
  std::size_t reported = 0;
  std::size_t unreadable = 0;
  std::size_t unsure = 0;
  std::size_t empty = 0;
  std::string first;
  std::map<Reason, std::size_t> reasons;
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    const Quality quality = QualityAt(record, i, now.instant);
    if (IsGood(quality) || quality == Quality::bad_waiting) continue;
    // What the reading itself said is the device's word; the rest is doubt or age.
    const bool in_doubt = quality == Quality::uncertain && quality == record.points[i].at_best;
    const bool said = quality == record.points[i].reported;
    // What a reader has not read yet is not missing.
    if (said && record.status.unasked && quality.reason == Reason::not_ready) continue;
    const auto group = static_cast<std::size_t>(record.device->points[i].group);
    const AgeLimits& limits = record.age_limits[group];
    // The port is open for a shorter time than that: the polls have not had their chance.
    const bool waits = limits.ages() && open < limits.uncertain_after;
    if (!said && !in_doubt && waits) continue;
    ++(said ? reported : in_doubt ? doubted : stale);
    if (said && quality.reason != Reason::none) ++reasons[quality.reason];
    if (said && quality.reason == Reason::none) {
      ++(quality == Quality::bad_sensor_failure ? empty
         : IsUncertain(quality)                 ? unsure
                                                : unreadable);
    }
    if (said && first.empty()) first = record.device->points[i].name;
  }
  Sentences found;
  if (const auto every = ComesEvery(record, now.instant); stale > 0 && every) {
    found.push_back("comes every " + FormatAge(*every) +
                    ", and its max_age is shorter: raise its poll (or max_age) above that, or let "
                    "it send more often");
  } else if (stale > 0 && record.status.unasked && record.status.last_ok) {
    found.push_back("nothing has come for " + FormatAge(now.instant - *record.status.last_ok) +
                    ", and its max_age is shorter: check its power and its wire");
  } else if (stale > 0) {
    found.push_back(
        fmt::format("{} of {} points are older than their max_age: its polls fail or "
                    "come too seldom",
                    stale, record.points.size()));
  }
  if (doubted > 0) {
    found.push_back(
        fmt::format("{} of {} points are in doubt until they are read again: the port was opened "
                    "anew, the device was away, or a reply may have belonged to another request",
                    doubted, record.points.size()));
  }
  if (reported > 0) {
    std::string why;
    for (const auto& [reason, count] : reasons) {
      why += fmt::format("{}{} {}", why.empty() ? " (" : ", ", count, Name(reason));
    }
    why += (why.empty() ? " (" : "; ") + first + (reported > 1 ? ", ...)" : ")");
    if (unsure == reported) {
      why += ": it says itself that they are not certain (not stable): look at what it measures";
    }
    const Findings& findings = record.status.findings;
    if (unreadable + empty == reported && findings.Count(Symptom::no_number) > 0) {
      why += NoNumber(findings.Last(Symptom::no_number));
    } else if (unreadable == reported) {
      why += ": it says that they are not valid, or sends another form: look at its sensors";
    } else if (empty == reported) {
      why += ": it sends no number for them (a decimal comma?); see trace";
    }
    if (reasons.size() == 1 && reasons.begin()->second == reported) {
      const char* const remedy = RemedyFor(reasons.begin()->first);
      const bool inputs = reasons.begin()->first != Reason::device_fault &&
                          reasons.begin()->first != Reason::no_permission;
      const bool all = inputs && reported == record.points.size() && reported > 1;
      if (remedy != nullptr) {
        why += all ? ": nothing measures: look at what is behind the device" : ": ";
        why += all ? "" : remedy;
      }
    }
    if (reasons.contains(Reason::not_fitted)) {
      const std::string said = Brief(record.status.findings.Last(Symptom::refusal));
      why += said.empty() ? ": it does not answer requests for them" : ": it says '" + said + "'";
      why += "; " + (RefusesWhatItGave(record) ? std::string(kHasWorked)
                                               : std::string(kProfileFits) + "?");
    }
    found.push_back(
        fmt::format("{} of {} points have no good value{}", reported, record.points.size(), why));
  }
  for (std::string& sentence : AbsurdNumbers(record, now)) found.push_back(std::move(sentence));
  return found;
}

Sentences DiagnoseWaiting(const DeviceRecord& record, Now now, Instant started) {
  std::size_t waiting = 0;
  std::string first;
  const Findings& findings = record.status.findings;
  const Finding& odd = findings.Last(Symptom::odd);
  const Finding& said = odd.cause.empty() ? findings.Last(Symptom::refusal) : odd;
  // What is asked seldom has been asked by then as well, and it has said no.
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
    // Messages come one after another, and none of them has these values.
    if (findings.size() < kManyMessages || !MustSpeakWithin(record)) return {};
    const std::string& missing = record.status.missing;
    return {fmt::format("{} of {} points have no value yet ({}{}): {}", waiting,
                        record.points.size(), first, waiting > 1 ? ", ..." : "",
                        missing.empty()
                            ? "nothing that it sends has them: does the profile fit, and its "
                              "parameters (unit)?"
                            : missing)};
  }
  return {fmt::format(
      "{} of {} points have no value yet ({}{}): {}: {}", waiting, record.points.size(), first,
      waiting > 1 ? ", ..." : "",
      said.cause.empty() ? "the device does not give them" : "it says '" + Brief(said) + "'",
      RemedyOf(said))};
}

}  // namespace baudgate::control
