// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/archive/billing_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "gateway/base/text.h"
#include "protocols/set4tm/meter/clock.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/status.h"

namespace baudgate::protocols::set4tm {
namespace {

using std::chrono::days;
using std::chrono::local_days;
using std::chrono::months;
using std::chrono::year_month_day;

/// Arrays of 0A (reference, 8.4).
constexpr std::uint8_t kOfMonth = 0x83;
constexpr std::uint8_t kOfToday = 0x84;
constexpr std::uint8_t kOfDay = 0x86;
constexpr std::uint8_t kAllEnergies = 0x0F;
constexpr std::size_t kRegisters = 4;
constexpr std::array<const char*, kRegisters> kNames = {"active_import", "active_export",
                                                        "reactive_import", "reactive_export"};
constexpr months kMostMonths(11);
/// In no month an older one stands at the same day.
constexpr days kMostDays(27);

const Bytes kAskClock = {kJournal, 0x00};

std::string_view NameOf(BillingPeriod kind) { return kind == BillingPeriod::day ? "day" : "month"; }

std::string DayText(local_days day) {
  return FormatWallTime(WallTime(day.time_since_epoch())).substr(0, 10);
}

std::optional<local_days> ParseDay(std::string_view text) {
  if (text.size() != 10) return std::nullopt;
  const auto year = ParseInteger<int>(text.substr(0, 4));
  const auto month = ParseInteger<unsigned>(text.substr(5, 2));
  const auto day = ParseInteger<unsigned>(text.substr(8, 2));
  if (!year || !month || !day) return std::nullopt;
  const year_month_day date{std::chrono::year(*year), std::chrono::month(*month),
                            std::chrono::day(*day)};
  return date.ok() ? std::optional(local_days(date)) : std::nullopt;
}

local_days FirstOfMonth(local_days day) {
  const year_month_day date(day);
  return local_days(date.year() / date.month() / 1);
}

/// Nothing was written there yet.
bool IsBlank(View registers) {
  const auto all = [registers](std::uint8_t value) {
    return std::ranges::all_of(registers, [value](std::uint8_t byte) { return byte == value; });
  };
  return all(0x00) || all(0xFF);
}

}  // namespace

BillingSession::BillingSession(const Settings& settings)
    : zone_(settings.time_zone.value_or(CivilZone())),
      tariffs_(static_cast<std::size_t>(settings.billing_tariffs)) {
  if (!settings.time_zone) return;
  for (const BillingPeriod kind : settings.billing) periods_.push_back({.kind = kind});
}

std::optional<Instant> BillingSession::NextDue() const {
  const bool all = std::ranges::all_of(periods_, [](const Period& one) { return one.refused; });
  return all ? std::nullopt : std::optional(due_);
}

void BillingSession::Recall(std::string_view said) {
  for (const std::string_view part : Split(said, ';')) {
    for (Period& period : periods_) {
      const std::string name = std::string(NameOf(period.kind)) + ' ';
      if (!part.starts_with(name)) continue;
      const auto day = ParseDay(part.substr(name.size()));
      if (day) period.kept = day;
    }
  }
}

std::string BillingSession::Said(BillingPeriod kind, Day day) const {
  std::string text;
  for (const Period& period : periods_) {
    const auto its = period.kind == kind ? std::optional(day) : period.kept;
    if (its)
      text += fmt::format("{}{} {}", text.empty() ? "" : ";", NameOf(period.kind), DayText(*its));
  }
  return text;
}

// ---------------------------------------------------------------- what is asked

/// The oldest that the meter may have and that is not kept.
std::optional<BillingSession::Day> BillingSession::NextOf(const Period& period) const {
  if (period.refused || period.rests_until > latest()) return std::nullopt;
  const bool by_day = period.kind == BillingPeriod::day;
  const auto behind = [by_day](Day day) {
    if (by_day) return day + days(1);
    const year_month_day date = year_month_day(day) + months(1);
    return Day(date);
  };
  const Day last = by_day ? *today_ : FirstOfMonth(*today_);
  Day next = by_day ? last - kMostDays : Day(year_month_day(last) - kMostMonths);
  for (const auto& done : {period.kept, period.empty}) {
    if (done && *done >= next) next = behind(*done);
  }
  return next <= last ? std::optional(next) : std::nullopt;
}

bool BillingSession::Choose() {
  pass_.reset();
  for (std::size_t i = 0; i < periods_.size() && !pass_; ++i) {
    if (const auto begin = NextOf(periods_[i])) pass_ = Pass{.period = i, .begin = *begin};
  }
  if (pass_) pass_->registers.resize(tariffs());
  return pass_.has_value();
}

Bytes BillingSession::RegisterRequest() const {
  const year_month_day date(pass_->begin);
  const auto tariff = static_cast<std::uint8_t>(TariffOf(pass_->step));
  std::uint8_t array = kOfMonth;
  auto which = static_cast<std::uint8_t>(unsigned{date.month()});
  if (periods_[pass_->period].kind == BillingPeriod::day) {
    const bool is_today = pass_->begin == *today_;
    array = is_today ? kOfToday : kOfDay;
    which = is_today ? std::uint8_t{0} : static_cast<std::uint8_t>(unsigned{date.day()});
  }
  return {kEnergyExtended, array, which, tariff, kAllEnergies, 0x00};
}

Bytes BillingSession::NextPdu() { return reads_registers() ? RegisterRequest() : kAskClock; }

// ---------------------------------------------------------------- what comes

Answer BillingSession::TakeData(View data, const Scale& scale) {
  due_ = latest();
  if (reads_registers()) {
    OnRegister(data);
    return {};
  }
  const auto civil = data.size() > kCivilSize ? CivilOf(data.first(kCivilSize)) : std::nullopt;
  if (!civil) {
    OnFailure(latest());
    return {};
  }
  return OnDay(std::chrono::floor<days>(*civil), scale);
}

void BillingSession::OnRegister(View data) {
  Bytes& its = pass_->registers[TariffOf(pass_->step)];
  const bool again = pass_->step >= tariffs();
  pass_->differs = pass_->differs || (again && !std::ranges::equal(its, data));
  its.assign(data.begin(), data.end());
  ++pass_->step;
}

Answer BillingSession::OnDay(Day day, const Scale& scale) {
  const bool same = today_ == day;
  today_ = day;
  if (pass_ && same && !pass_->differs) return Finish(scale);
  if (pass_ && pass_->differs) due_ = latest() + kRest;
  if (!Choose()) {
    today_.reset();
    due_ = latest() + kLook;
  }
  return {};
}

Answer BillingSession::Finish(const Scale& scale) {
  const Pass pass = *std::exchange(pass_, std::nullopt);
  Period& period = periods_[pass.period];
  const auto factor = FactorOf(Measure::energy, scale);
  const bool blank = IsBlank(pass.registers[0]);
  if (!factor || blank) {
    if (!factor || pass.begin == *today_) {
      period.rests_until = latest() + kLook;
    } else {
      period.empty = pass.begin;
    }
    today_.reset();
    return {};
  }
  PastRecord record;
  record.series = NameOf(period.kind);
  record.begin = zone_.ToUtc(CivilZone::Civil(pass.begin)).utc.time_since_epoch();
  for (std::size_t tariff = 0; tariff < pass.registers.size(); ++tariff) {
    const ByteReader registers(pass.registers[tariff]);
    for (std::size_t i = 0; i < kRegisters; ++i) {
      const auto count = registers.U32Be(4 * i);
      PastValue value{kNames[i], {}, Quality::bad_configuration, i < 2 ? "kWh" : "kvarh"};
      if (tariff > 0) value.name += "_t" + std::to_string(tariff);
      if (count && *count != 0xFFFFFFFF) {
        value.value = *count * factor->multiply / factor->divide;
        value.quality = Quality::good;
      }
      record.values.push_back(std::move(value));
    }
  }
  Answer answer;
  answer.batch = EventBatch{};
  answer.batch->said = Said(period.kind, pass.begin);
  answer.batch->past.push_back(std::move(record));
  return answer;
}

/// The meter does not have this tariff, or does not know calendar days, or has no readings at all.
Answer BillingSession::Refused(Answer answer) {
  due_ = latest();
  if (!today_ || !pass_) {
    for (Period& period : periods_) period.refused = true;
    return answer;
  }
  if (TariffOf(pass_->step) > 0) {
    OnRegister({});
    return {};
  }
  Period& period = periods_[pass_->period];
  const bool calendar = period.kind == BillingPeriod::day && pass_->begin != *today_;
  if (calendar) period.empty = *today_ - days(1);
  if (!calendar) period.refused = true;
  if (!Choose()) today_.reset();
  if (calendar) return {};
  return answer;
}

void BillingSession::OnFailure(Instant now) {
  pass_.reset();
  today_.reset();
  due_ = now + kRest;
}

void BillingSession::OnReconnect() {
  pass_.reset();
  today_.reset();
  for (Period& period : periods_) period.empty.reset();
  ForgetRefusals();
}

void BillingSession::ForgetRefusals() {
  for (Period& period : periods_) period.refused = false;
}

std::string BillingSession::Shown() const {
  std::vector<std::string> shown;
  for (const Period& period : periods_) {
    if (period.refused) {
      shown.push_back(
          fmt::format("no billing readings of each {}: it refuses them", NameOf(period.kind)));
    } else if (period.kept) {
      shown.push_back(fmt::format("billing readings of each {} to {}", NameOf(period.kind),
                                  DayText(*period.kept)));
    }
  }
  return Listed(shown);
}

}  // namespace baudgate::protocols::set4tm
