// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/archive/journals.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/set4tm/meter/clock.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/printed.h"

namespace baudgate::protocols::set4tm {
namespace {

using Kind = Journal::Kind;

constexpr std::size_t kStatusWord = 9;
/// The short form of a request (04) has four bits for the journal and four for the record. Journals
/// above this number need the long form (09).
constexpr std::uint8_t kLastOfShortForm = 0x0A;
constexpr std::size_t kShortRecords = 16;

constexpr std::array<Journal, 9> kJournals = {{{0x01, Kind::interval, true, "power"},
                                               {0x07, Kind::interval, true, "phase 1"},
                                               {0x08, Kind::interval, true, "phase 2"},
                                               {0x09, Kind::interval, true, "phase 3"},
                                               {0x0A, Kind::interval, false, "terminal cover"},
                                               {0x3C, Kind::status, false, "status"},
                                               {0x02, Kind::correction, false, "clock"},
                                               {0x05, Kind::moment, false, "energy reset"},
                                               {0x06, Kind::moment, false, "profile 1"}}};

bool AllAre(View bytes, std::uint8_t value) {
  return std::ranges::all_of(bytes, [value](std::uint8_t byte) { return byte == value; });
}

std::string Written(CivilZone::Civil civil) {
  const WallTime wall(civil.time_since_epoch());
  return FormatWallTime(wall).substr(0, 19);
}

DeviceEvent Unread(const Journal& journal, View record) {
  return {0, 0, {}, fmt::format("journal {:02X}: {}", journal.number, ToHex(record))};
}

void Join(std::string& text, const std::string& more) {
  text += (text.empty() || more.empty() ? "" : ", ") + more;
}

}  // namespace

std::span<const Journal> Journals() { return kJournals; }

Bytes JournalRequest(const Journal& journal, std::size_t record) {
  const auto place = static_cast<std::uint8_t>(record);
  if (journal.number > kLastOfShortForm || record >= kShortRecords) {
    return {kJournalExtended, journal.number, place};
  }
  return {kJournal, static_cast<std::uint8_t>(unsigned{journal.number} << 4U | place)};
}

bool IsEmpty(View record) { return AllAre(record, 0x00) || AllAre(record, 0xFF); }

bool HasEnded(View before, View record) {
  if (before.size() != 2 * kCivilSize || record.size() != 2 * kCivilSize) return false;
  return std::ranges::equal(before.first(kCivilSize), record.first(kCivilSize)) &&
         AllAre(before.subspan(kCivilSize), 0) && !AllAre(record.subspan(kCivilSize), 0);
}

DeviceEvent JournalReader::At(std::uint32_t code, CivilZone::Civil civil, std::string text) const {
  if (!zone) {
    std::string shown = Written(civil) + " by its clock";
    Join(shown, text);
    return {0, code, {}, std::move(shown)};
  }
  const CivilZone::Moment moment = zone->ToUtc(civil);
  if (moment.fit == CivilZone::Fit::twice) Join(text, "the true time may be an hour earlier");
  if (moment.fit == CivilZone::Fit::never)
    Join(text, "the meter's clock was not set to summer time");
  return {0, code, SaidTime{moment.utc.time_since_epoch(), {}}, std::move(text)};
}

std::vector<DeviceEvent> JournalReader::EventsOf(const Journal& journal, View record,
                                                 View before) const {
  const View first = record.first(std::min(kCivilSize, record.size()));
  const View second = record.subspan(first.size());
  const auto civil = CivilOf(first);
  const bool pair = journal.kind == Kind::interval || journal.kind == Kind::correction;
  const std::size_t length = journal.kind == Kind::moment ? kCivilSize : 2 * kCivilSize;
  const bool ended = pair && second.size() == kCivilSize && !AllAre(second, 0);
  const auto end = ended ? CivilOf(second) : std::nullopt;
  if (record.size() != length || !civil || (ended && !end)) return {Unread(journal, record)};
  switch (journal.kind) {
    case Kind::moment:
      return {At(BeginCode(journal), *civil, {})};
    case Kind::status: {
      const View word = record.subspan(kStatusWord);
      return {At(BeginCode(journal), *civil, knows_status ? FlagsOf(word) : ToHex(word))};
    }
    case Kind::correction: {
      if (!end) return {};
      const auto by = (*end - *civil).count();
      return {At(EndCode(journal), *end, fmt::format("by {:+} s", by))};
    }
    case Kind::interval:
      break;
  }
  std::vector<DeviceEvent> events;
  if (before.empty()) events.push_back(At(BeginCode(journal), *civil, {}));
  if (end) events.push_back(At(EndCode(journal), *end, {}));
  return events;
}

namespace {

/// A journal is read again until a reading equals the reading before it or the stored records,
/// because readings differ if replies are late. After this many readings follows a pause of kRest.
constexpr int kMostTimes = 6;
constexpr Duration kRest = std::chrono::minutes(1);

using Records = std::vector<Bytes>;

std::string Written(const Records& records) {
  std::string text;
  for (const Bytes& record : records) {
    if (!text.empty()) text += '.';
    if (IsEmpty(record)) text += '-';
    if (IsEmpty(record)) continue;
    for (const std::uint8_t byte : record) text += HexByte(byte);
  }
  return text;
}

std::optional<Records> ReadRecords(std::string_view text) {
  Records records;
  for (const std::string_view word : Split(text, '.')) {
    if (word == "-") {
      records.emplace_back();
      continue;
    }
    auto bytes = ParseHex(word);
    if (!bytes || bytes->empty()) return std::nullopt;
    records.push_back(std::move(*bytes));
  }
  return records;
}

std::optional<std::size_t> Newest(const Records& records) {
  for (std::size_t i = records.size(); i-- > 0;) {
    if (!IsEmpty(records[i])) return i;
  }
  return std::nullopt;
}

/// Calls `report` in order for each of `records` that is not in `kept`, the records of the last
/// stored state. The second argument of `report` is the record in `kept` of the same interval, if
/// the interval was open then and has ended now, else an empty record. Returns how many records of
/// `kept` still occur.
template <typename Report>
std::size_t Compare(const Records& records, Records kept, const Report& report) {
  std::erase_if(kept, [](const Bytes& record) { return IsEmpty(record); });
  std::size_t found = 0;
  const auto take = [&kept, &found](const auto& is) -> std::optional<Bytes> {
    const auto one = std::ranges::find_if(kept, is);
    if (one == kept.end()) return std::nullopt;
    ++found;
    Bytes record = std::move(*one);
    kept.erase(one);
    return record;
  };
  Records fresh;
  for (const Bytes& record : records) {
    if (IsEmpty(record)) continue;
    const bool known = take([&](const Bytes& other) { return other == record; }).has_value();
    if (!known) fresh.push_back(record);
  }
  for (const Bytes& record : fresh) {
    const auto before = take([&](const Bytes& other) { return HasEnded(other, record); });
    report(record, before.value_or(Bytes()));
  }
  return found;
}

}  // namespace

JournalSession::JournalSession(bool wanted, std::size_t records)
    : wanted_(wanted), records_(records) {
  for (const Journal& journal : Journals()) {
    State& state = states_.emplace_back();
    state.journal = &journal;
    state.records = records;
  }
}

bool JournalSession::has_events() const { return wanted_ && recalled_ && !has_refused(); }

bool JournalSession::has_refused() const {
  return std::ranges::all_of(states_, [](const State& state) { return state.refused; });
}

std::string JournalSession::Said(const State& instead, const Records& records) const {
  KeptParts kept{.meter = meter_.serial()};
  for (const State& state : states_) {
    const bool is_this = &state == &instead;
    if (!is_this && !state.kept) continue;
    kept.parts.push_back(
        {HexByte(state.journal->number), Written(is_this ? records : *state.kept)});
  }
  return kept.Text();
}

void JournalSession::OnKept(std::string_view said) {
  recalled_ = true;
  for (State& state : states_) state.kept.reset();
  meter_.Forget();
  const auto kept = KeptParts::Parse(said);
  if (!kept || meter_.OnKept(kept->meter)) return;
  for (const KeptParts::Part& part : kept->parts) {
    for (State& state : states_) {
      if (part.name == HexByte(state.journal->number)) state.kept = ReadRecords(part.text);
    }
  }
}

void JournalSession::OnMeter(std::uint32_t serial) {
  if (meter_.serial() != 0 && meter_.serial() != serial) pass_.reset();
  if (!meter_.OnMeter(serial)) return;
  for (State& state : states_) {
    state.kept.reset();
    state.due = true;
  }
}

bool JournalSession::MayAsk(const State& state, Instant now) const {
  return !state.refused && state.rests_until <= now;
}

/// Starts to read all records of a journal: of one that was never read, else of the one that was
/// read longest ago. Returns false if no journal is due.
bool JournalSession::Begin(Instant now) {
  std::optional<std::size_t> first;
  const auto rank = [this](std::size_t i) {
    return std::pair(states_[i].kept.has_value(), states_[i].read_at);
  };
  for (std::size_t i = 0; i < states_.size(); ++i) {
    State& state = states_[i];
    if (state.kept && now - state.read_at >= kWholeEvery) state.due = true;
    if (!MayAsk(state, now) || (state.kept && !state.due)) continue;
    if (!first || rank(i) < rank(*first)) first = i;
  }
  if (first) pass_ = Pass{.state = *first};
  return first.has_value();
}

/// Chooses the next journal for a look, which reads the position where a new record appears.
/// `urgent`: which journals to choose from. Returns false if none of them can be read now.
bool JournalSession::LookAt(bool urgent, Instant now) {
  std::size_t& turn = urgent ? urgent_turn_ : other_turn_;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    turn = (turn + 1) % states_.size();
    const State& state = states_[turn];
    if (state.journal->urgent != urgent || !state.kept || !MayAsk(state, now)) continue;
    asked_ = turn;
    return true;
  }
  return false;
}

/// Chooses the journal of a task, once per task. While all records of one journal are read, every
/// second task looks for a new record in another journal, unless Pass::soon is set.
void JournalSession::Choose(Instant now) {
  chosen_ = true;
  if (pass_ && !MayAsk(states_[pass_->state], now)) pass_.reset();
  const bool whole = pass_ || Begin(now);
  const unsigned turn = ++turn_;
  if (!whole) {
    const bool urgent = turn % 2 != 0;
    looks_ = LookAt(urgent, now) || LookAt(!urgent, now);
  } else {
    looks_ = !pass_->soon && turn % 2 != 0 && LookAt(turn % 4 == 1, now);
  }
  if (looks_) return;
  if (!pass_) {
    // Every journal is paused or refused: the task takes the journal whose pause ends first, and a
    // refused journal only if all are refused.
    const auto rests = [](const State& state) {
      return std::pair(state.refused, state.rests_until);
    };
    const auto first = std::ranges::min_element(states_, {}, rests);
    pass_ = Pass{.state = static_cast<std::size_t>(first - states_.begin())};
  }
  asked_ = pass_->state;
}

/// Returns the position that a look reads, because a new record appears there. In a full journal
/// this is the last position; otherwise, alternately, the position of the newest record and the
/// position after it.
std::size_t JournalSession::PlaceToLook(const State& state) {
  const std::size_t last = state.records - 1;
  const auto newest = state.kept ? Newest(*state.kept) : std::nullopt;
  if (newest && *newest >= last) return last;
  if (!newest) return state.beyond ? 0 : last;
  return state.beyond ? *newest + 1 : *newest;
}

Bytes JournalSession::Next(Instant now) {
  if (!chosen_ || (!looks_ && !pass_)) Choose(now);
  const State& state = states_[asked_];
  if (looks_) {
    place_ = PlaceToLook(state);
  } else {
    const std::size_t read = pass_->records.size();
    place_ = pass_->backwards ? state.records - 1 - read : read;
  }
  return JournalRequest(*state.journal, place_);
}

Answer JournalSession::GoOn() {
  if (exchanges_ >= (pass_ && pass_->soon ? kMostExchanges : 1)) return End();
  Answer answer;
  answer.then = Then::ask_again;
  return answer;
}

Answer JournalSession::End(Answer answer) {
  exchanges_ = 0;
  chosen_ = false;
  return answer;
}

Answer JournalSession::Take(View record, const JournalReader& reader, Instant now) {
  ++exchanges_;
  State& state = states_[asked_];
  state.failures = 0;
  if (looks_) return OnLook(state, record);
  Pass& pass = *pass_;
  pass.records.emplace_back(record.begin(), record.end());
  if (pass.records.size() < state.records) return GoOn();
  if (pass.backwards) std::ranges::reverse(pass.records);
  return OnWhole(state, std::exchange(pass.records, {}), reader, now);
}

Answer JournalSession::OnLook(State& state, View record) {
  state.beyond = !state.beyond;
  const Bytes nothing;
  const bool known = state.kept && place_ < state.kept->size();
  const View before = known ? View((*state.kept)[place_]) : View(nothing);
  const bool same = IsEmpty(record) ? IsEmpty(before) : std::ranges::equal(record, before);
  if (same) return End();
  state.due = true;
  looks_ = false;
  pass_ = Pass{.state = asked_, .soon = true};
  return GoOn();
}

Answer JournalSession::OnWhole(State& state, Records records, const JournalReader& reader,
                               Instant now) {
  Pass& pass = *pass_;
  const auto same = [](const Bytes& a, const Bytes& b) {
    return a == b || (IsEmpty(a) && IsEmpty(b));
  };
  const auto equal = [&same](const std::optional<Records>& other, const Records& these) {
    return other && std::ranges::equal(*other, these, same);
  };
  if (equal(state.kept, records) || equal(pass.before, records)) {
    pass_.reset();
    return Report(state, std::move(records), reader, now);
  }
  pass.before = std::move(records);
  pass.backwards = !pass.backwards;
  if (++pass.times < kMostTimes) return GoOn();
  pass_.reset();
  state.rests_until = now + kRest;
  return End();
}

/// Returns the events of the new records. They count as reported when OnKept confirms that they are
/// stored. Until then state.kept is unchanged, so the new records are found again.
Answer JournalSession::Report(State& state, Records records, const JournalReader& reader,
                              Instant now) {
  EventBatch batch;
  const Records kept = state.kept.value_or(Records());
  const std::size_t left = Compare(records, kept, [&](const Bytes& record, const Bytes& before) {
    for (DeviceEvent& event : reader.EventsOf(*state.journal, record, before)) {
      batch.events.push_back(std::move(event));
    }
  });
  const bool full = std::ranges::none_of(records, [](const Bytes& one) { return IsEmpty(one); });
  if (full && left == 0 && Newest(kept)) {
    batch.events.insert(
        batch.events.begin(),
        {0,
         GapCode(*state.journal),
         {},
         fmt::format(
             "journal {:02X}, {}: all stored records are new, so earlier records may be missing",
             state.journal->number, state.journal->name)});
  }
  state.read_at = now;
  if (batch.events.empty()) {
    state.due = false;
    state.kept = std::move(records);
    return End();
  }
  batch.said = Said(state, records);
  state.due = false;
  Answer answer;
  answer.batch = std::move(batch);
  return End(std::move(answer));
}

/// Takes a refusal: the meter does not have the journal (at the first position), or the journal has
/// fewer records than expected (at a later position).
Answer JournalSession::TakeRefusal(Answer answer, Instant now) {
  ++exchanges_;
  State& state = states_[asked_];
  const bool known = state.kept && place_ < state.kept->size() && !IsEmpty((*state.kept)[place_]);
  answer.readings.clear();
  looks_ = false;
  pass_.reset();
  if (place_ == 0) {
    // The journal exists, because it was read before, so this refusal counts as a failure.
    if (state.kept) {
      OnFailure(answer.outcome, now);
      return End(std::move(answer));
    }
    state.refused = true;
    if (!has_events()) answer.then = Then::replan;
    return End(std::move(answer));
  }
  state.due = true;
  if (known) {
    OnFailure(answer.outcome, now);
    return End(std::move(answer));
  }
  state.records = place_;
  return GoOn();
}

void JournalSession::OnFailure(Outcome outcome, Instant now) {
  exchanges_ = 0;
  chosen_ = false;
  if (outcome == Outcome::busy) return;
  State& state = states_[asked_];
  if (++state.failures < kMostFailures) return;
  state.failures = 0;
  state.rests_until = now + kWholeEvery;
}

void JournalSession::OnReconnect() {
  pass_.reset();
  looks_ = chosen_ = false;
  exchanges_ = 0;
  for (State& state : states_) {
    state.due = true;
    state.failures = 0;
    state.rests_until = {};
  }
  ForgetRefusals();
}

void JournalSession::ForgetRefusals() {
  for (State& state : states_) {
    state.refused = false;
    state.records = records_;
  }
}

}  // namespace baudgate::protocols::set4tm
