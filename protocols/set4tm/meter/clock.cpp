// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/clock.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/values.h"

namespace baudgate::protocols::set4tm {
namespace {

std::optional<unsigned> FromBcd(std::uint8_t byte) {
  if ((byte & 0x0FU) > 9 || byte >> 4U > 9) return std::nullopt;
  return (byte >> 4U) * 10U + (byte & 0x0FU);
}

template <typename T>
std::uint8_t ToBcd(T value) {
  const auto number = static_cast<unsigned>(value);
  return static_cast<std::uint8_t>(number / 10 << 4U | number % 10);
}

}  // namespace

std::optional<CivilZone::Civil> CivilOf(View bytes) {
  std::array<unsigned, kCivilSize> parts{};
  if (bytes.size() != kCivilSize) return std::nullopt;
  for (std::size_t i = 0; i < kCivilSize; ++i) {
    const auto two = FromBcd(bytes[i]);
    if (!two) return std::nullopt;
    parts[i] = *two;
  }
  const std::chrono::year_month_day date{std::chrono::year(static_cast<int>(2000 + parts[6])),
                                         std::chrono::month(parts[5]), std::chrono::day(parts[4])};
  if (!date.ok() || parts[0] > 59 || parts[1] > 59 || parts[2] > 23) return std::nullopt;
  return std::chrono::local_days(date) + std::chrono::hours(parts[2]) +
         std::chrono::minutes(parts[1]) + std::chrono::seconds(parts[0]);
}

Bytes BytesOf(CivilZone::Civil civil) {
  const auto day = std::chrono::floor<std::chrono::days>(civil);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(civil - day);
  return {ToBcd(clock.seconds().count()),
          ToBcd(clock.minutes().count()),
          ToBcd(clock.hours().count()),
          static_cast<std::uint8_t>(std::chrono::weekday(day).iso_encoding()),
          ToBcd(unsigned{date.day()}),
          ToBcd(unsigned{date.month()}),
          ToBcd(int{date.year()} % 100)};
}

namespace {

/// The largest correction, in seconds, that access level 1 allows at once (reference, chapter 10).
constexpr double kMostSeconds = 120;
constexpr std::uint8_t kCorrectClockCode = 0x0B;

}  // namespace

bool AsksClock(View pdu) {
  return std::ranges::equal(pdu, Bytes{kJournal, 0}) ||
         std::ranges::equal(pdu, Bytes{kJournalExtended, 0, 0});
}

void ClockDrift::OnSent(Now arrives, Duration character) {
  if (!first_) first_ = arrives.instant;
  arrives_ = arrives;
  character_ = character;
}

Decoded ClockDrift::Of(View data, std::size_t bytes, const Scale& scale, Instant now) {
  constexpr double kHalf = 0.5;
  latest_.reset();
  const Decoded clock = DecodeField({{}, Decoder::clock, 0, 0}, data, scale);
  if (!IsGood(clock.quality)) return clock;
  if (!first_) return {{}, Quality::bad_waiting};
  const Duration reply = static_cast<std::int64_t>(bytes) * character_;
  const Instant began = std::max(now - reply, arrives_.instant);
  const WallTime looked = arrives_.wall + (began - arrives_.instant) / 2;
  const std::chrono::duration<double> host = looked.time_since_epoch();
  const double drift = ToDouble(clock.value) + kHalf - host.count();
  const bool good = right_ && began - *first_ <= kWidest;
  if (good) {
    latest_ = drift;
    latest_at_ = now;
  }
  return {drift, good ? Quality::good : Quality::uncertain_sub_normal};
}

std::optional<double> ClockDrift::Latest(Instant now) const {
  return right_ && now - latest_at_ <= kFresh ? latest_ : std::nullopt;
}

Result<Bytes> ClockCorrection(const Value& value, const ClockDrift& drift, Instant now) {
  double seconds = ToDouble(value);
  if (const auto* by_drift = std::get_if<bool>(&value)) {
    if (!*by_drift) return Error{"false has no effect; write true to correct the clock"};
    const auto latest = drift.Latest(now);
    if (!latest) {
      return Error{
          "the drift of the meter's clock is not known; add a point with read: \"04 00 drift@0\", "
          "and synchronise this machine's clock"};
    }
    seconds = std::round(-*latest);
    if (seconds == 0)
      return Error{"the meter's clock differs by less than 0.5 s, so no correction is needed"};
  } else if (seconds == 0 || seconds != std::round(seconds)) {
    return Error{
        "a meter's clock can be corrected only by whole seconds; write 1 to 120, or -1 to -120"};
  }
  if (!(std::abs(seconds) <= kMostSeconds)) {
    return Error{"a meter's clock can be corrected by 120 s at most, once a day; this is " +
                 std::to_string(std::lround(seconds)) + " s: set the clock by hand"};
  }
  const auto bits = static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(seconds)));
  return Bytes{kWrite, kCorrectClockCode, static_cast<std::uint8_t>(bits >> 8U),
               static_cast<std::uint8_t>(bits & 0xFFU)};
}

}  // namespace baudgate::protocols::set4tm
