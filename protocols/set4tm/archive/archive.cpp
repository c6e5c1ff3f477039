// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/archive/archive.h"

#include <fmt/format.h>

#include <algorithm>

#include "gateway/base/text.h"
#include "gateway/base/time.h"
#include "protocols/set4tm/meter/clock.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/status.h"

namespace baudgate::protocols::set4tm {
namespace {

/// The memory numbers of load profiles 1, 2 and 3 in a request (reference, chapter 11).
constexpr std::array<std::uint8_t, 3> kMemoryOf = {0x03, 0x08, 0x09};
constexpr std::uint8_t kPointer = 0x04;
constexpr std::uint8_t kInterval = 0x06;
/// How many bytes of memory one reply can have. Old meters (kShortTypes) send up to 16 bytes of
/// data, all others up to 93 (reference, chapter 3), which hold 11 records of 8 bytes.
constexpr std::size_t kShortReply = 16;
constexpr std::size_t kLongReply = 88;
constexpr std::array<std::uint8_t, 4> kShortTypes = {0, 2, 4, 9};

/// Returns the request for a parameter of a load profile. For profile 1 the profile number is left
/// out, because all meters support this form.
Bytes Ask(std::uint8_t parameter, unsigned profile) {
  Bytes pdu = {kRead, parameter};
  if (profile > 1) pdu.push_back(static_cast<std::uint8_t>(profile - 1));
  return pdu;
}

}  // namespace

LoadSession::LoadSession(const Settings& settings) {
  if (!settings.time_zone) return;
  for (const unsigned profile : settings.load_profiles) {
    const auto bytes = static_cast<std::size_t>(settings.load_records) * kLoadRecord;
    states_.push_back({.reader = {profile, *settings.time_zone, bytes}});
  }
}

std::optional<Instant> LoadSession::NextDue() const {
  std::optional<Instant> soonest;
  for (const State& state : states_) {
    if (!state.refused) soonest = Soonest({soonest, state.due});
  }
  return soonest;
}

std::string LoadSession::Said(const State& instead, const LoadPlace& place) const {
  KeptParts kept{.meter = meter_.serial()};
  for (const State& state : states_) {
    const bool is_this = &state == &instead;
    if (!is_this && (meter_.is_open() || state.kept.empty())) continue;
    kept.parts.push_back(
        {std::to_string(state.reader.profile()), is_this ? place.Text() : state.kept});
  }
  return kept.Text();
}

void LoadSession::Keep(State& state, std::string_view place, bool another) {
  if (!another && place == state.kept) return;
  state.kept = another ? std::string() : std::string(place);
  state.reader.OnKept(LoadPlace::Parse(place), another);
  state.due = state.reader.GoOn(manner()) ? latest() : latest() + kLook;
}

void LoadSession::Recall(std::string_view said) {
  const auto kept = KeptParts::Parse(said);
  if (!kept) return;
  const bool another = meter_.OnKept(kept->meter);
  for (const KeptParts::Part& part : kept->parts) {
    for (State& state : states_) {
      if (part.name == std::to_string(state.reader.profile())) Keep(state, part.text, another);
    }
  }
}

void LoadSession::OnMeter(std::uint32_t serial) {
  if (!meter_.OnMeter(serial)) return;
  for (State& state : states_) {
    if (!state.kept.empty()) Keep(state, std::string(state.kept), true);
  }
}

void LoadSession::OnType(std::optional<std::uint8_t> type) {
  const bool is_short = !type || std::ranges::count(kShortTypes, *type) > 0;
  most_ = is_short ? kShortReply : kLongReply;
}

Bytes LoadSession::NextPdu() {
  const auto first = std::ranges::min_element(
      states_, {}, [](const State& state) { return std::pair(state.refused, state.due); });
  asked_ = static_cast<std::size_t>(first - states_.begin());
  const LoadReader& reader = first->reader;
  if (reader.step() == LoadReader::Step::interval) return Ask(kInterval, reader.profile());
  if (reader.step() == LoadReader::Step::pointer) return Ask(kPointer, reader.profile());
  const MemoryRead::Stretch stretch = reader.stretch();
  Bytes pdu = {kMemory};
  if (tagged_) pdu = {kMemoryTagged, ++id_};
  const auto byte = [](std::size_t number) { return static_cast<std::uint8_t>(number & 0xFFU); };
  Append(pdu, Bytes{kMemoryOf[reader.profile() - 1], byte(stretch.address >> 8U),
                    byte(stretch.address), byte(stretch.count)});
  return pdu;
}

Answer LoadSession::TakeData(View data, const Scale& scale) {
  State& state = states_[asked_];
  LoadReader& reader = state.reader;
  Answer answer;
  bool more = true;
  switch (reader.step()) {
    case LoadReader::Step::interval:
      more = data.size() == 2 && reader.OnInterval(data[1]);
      break;
    case LoadReader::Step::pointer:
      blind_ = !FactorOf(Measure::energy, scale);
      more = !blind_ && reader.OnPointer(data, manner());
      break;
    case LoadReader::Step::memory: {
      // SET-4TM.03 can send two more bytes after the id (reference, chapter 11), so the last bytes
      // count.
      const std::size_t count = reader.stretch().count;
      if (data.size() < count) break;
      LoadReader::Taken taken = reader.OnMemory(data.last(count), scale, manner());
      more = taken.more;
      if (taken.records.empty()) break;
      answer.batch = EventBatch{};
      answer.batch->said = Said(state, taken.place);
      answer.batch->past = std::move(taken.records);
      break;
    }
  }
  state.due = more ? latest() : latest() + kLook;
  return answer;
}

/// Takes a refusal. If the meter refuses memory reads by 0C, memory is read by 06 from now on. Any
/// other refusal means that the meter does not have this profile.
Answer LoadSession::Refused(Answer answer) {
  State& state = states_[asked_];
  state.due = latest();
  if (state.reader.step() == LoadReader::Step::memory && tagged_) {
    tagged_ = false;
    for (State& one : states_) one.reader.BreakOff();
    return {};
  }
  state.refused = true;
  return answer;
}

void LoadSession::OnFailure(Instant now) {
  if (states_.empty()) return;
  states_[asked_].reader.BreakOff();
  states_[asked_].due = now + kRest;
}

void LoadSession::OnReconnect() {
  tagged_ = true;
  for (State& state : states_) {
    state.reader.OnReconnect();
    state.refused = false;
    state.due = latest();
  }
}

void LoadSession::ForgetRefusals() {
  for (State& state : states_) {
    if (std::exchange(state.refused, false)) state.due = latest();
  }
}

std::string LoadSession::Shown() const {
  if (blind_)
    return "load profiles cannot be read: set meter_constant, voltage_ratio and current_ratio";
  std::vector<std::string> shown;
  for (const State& state : states_) {
    const auto end = state.reader.end();
    const std::string name = NameOfLoad(state.reader.profile());
    if (state.refused) {
      shown.push_back(name + " is not read, because the meter refuses the request");
      continue;
    }
    if (!state.reader.trouble().empty()) shown.push_back(name + ": " + state.reader.trouble());
    if (end) shown.push_back(name + " is read up to " + FormatWallTime(WallTime(*end)));
    if (state.reader.waits()) {
      shown.push_back(name + ": the meter has not written the header of its current hour yet");
    }
  }
  return Listed(shown);
}

namespace {

using std::chrono::days;
using std::chrono::local_days;
using std::chrono::months;
using std::chrono::year_month_day;

/// Array numbers in requests of code 0A (reference, 8.4).
constexpr std::uint8_t kOfMonth = 0x83;
constexpr std::uint8_t kOfToday = 0x84;
constexpr std::uint8_t kOfDay = 0x86;
constexpr std::uint8_t kAllEnergies = 0x0F;
constexpr std::size_t kRegisters = 4;
constexpr std::array<const char*, kRegisters> kNames = {"active_import", "active_export",
                                                        "reactive_import", "reactive_export"};
constexpr months kMostMonths(11);
/// How many days back billing readings are read. A request names only the day of the month, and
/// each of these days occurs once in 28 days.
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

/// True if the meter has never written the registers: all bytes are 00, or all are FF.
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

/// Returns the beginning of the oldest day or month whose reading the meter may have and that is
/// not stored yet. Empty: all readings are stored, or none is requested now (rests_until, refused).
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

/// Takes a refusal: the meter does not have this tariff, or no calendar days, or no readings at
/// all.
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
      shown.push_back(fmt::format(
          "billing readings of each {} are not read, because the meter refuses the request",
          NameOf(period.kind)));
    } else if (period.kept) {
      shown.push_back(fmt::format("billing readings of each {} are read up to {}",
                                  NameOf(period.kind), DayText(*period.kept)));
    }
  }
  return Listed(shown);
}

namespace {

/// The values of load profiles and billing readings are counts of energy. They are converted with
/// the same constants as a point with this field.
const Match kCount = {kNoPoint, Field{{}, Decoder::energy, 0, 0}};

constexpr std::size_t PartOf(std::size_t job) { return job + 1; }

}  // namespace

MeterArchive::MeterArchive(bool events, const Settings& settings, Identification& identification)
    : events_(events),
      settings_(settings),
      identification_(identification),
      journals_(events, static_cast<std::size_t>(settings.journal_records)),
      loads_(settings),
      billing_(settings) {}

std::optional<Instant> MeterArchive::due() const {
  std::optional<Instant> soonest;
  for (const BackgroundJob* one : jobs_) soonest = Soonest({soonest, one->due()});
  return soonest;
}

bool MeterArchive::IsDue(Instant now) const { return HasCome(due(), now); }

void MeterArchive::OnKept(std::string_view said) {
  const auto changed = kept_.OnKept(said);
  if (changed[KeptTexts::kJournals]) journals_.OnKept(kept_.part(KeptTexts::kJournals));
  for (std::size_t i = 0; i < jobs_.size(); ++i) {
    if (changed[PartOf(i)]) jobs_[i]->OnKept(kept_.part(PartOf(i)));
  }
}

void MeterArchive::OnMeter(std::uint32_t serial) {
  journals_.OnMeter(serial);
  for (BackgroundJob* one : jobs_) one->OnMeter(serial);
}

void MeterArchive::OnReconnect() {
  journals_.OnReconnect();
  for (BackgroundJob* one : jobs_) one->OnReconnect();
}

void MeterArchive::ForgetRefusals(bool journals) {
  if (journals) journals_.ForgetRefusals();
  for (BackgroundJob* one : jobs_) one->ForgetRefusals();
}

Answer MeterArchive::TakeRecord(View data, Instant now) {
  const JournalReader reader{settings_.time_zone, identification_.KnowsStatusWord()};
  return kept_.With(KeptTexts::kJournals, journals_.Take(data, reader, now));
}

Answer MeterArchive::TakeNoRecord(Answer answer, Instant now) {
  return kept_.With(KeptTexts::kJournals, journals_.TakeRefusal(std::move(answer), now));
}

/// Returns the question to ask before a background task. The type is asked as well, because it
/// decides how long replies can be.
std::optional<Bytes> MeterArchive::Question() {
  identification_.WantType();
  return identification_.Question({&kCount, 1});
}

Bytes MeterArchive::NextInBackground(Instant now) {
  for (std::size_t i = 0; i < jobs_.size(); ++i) {
    const auto due = jobs_[i]->due();
    const auto other = job().due();
    if (due && (!other || *due < *other)) job_ = i;
  }
  job().OnType(identification_.type());
  return job().Next(now);
}

Answer MeterArchive::TakeInBackground(View data, Instant now) {
  return kept_.With(PartOf(job_), job().Take(data, identification_.scale(), now));
}

std::string MeterArchive::Learned() const {
  return Listed({events_ && journals_.has_refused()
                     ? "journals are not read, because the meter refuses the request"
                     : "",
                 loads_.Shown(), billing_.Shown()});
}

}  // namespace baudgate::protocols::set4tm
