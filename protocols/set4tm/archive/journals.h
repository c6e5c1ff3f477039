// The journals of a meter: which there are, how a record is laid out, and what events it tells
// (reference, 8.2). Times are the meter's local ones, without a zone.
//
//   journal 07, 31 30 15 01 02 09 02 · 00 00 00 00 00 00 00    E71 2002-09-02T15:30:31, not over
//   yet … 31 30 15 01 02 09 02 · 12 32 15 01 02 09 02              E71, E72 2002-09-02T15:32:12 …
//   99 30 15 …                                               E0, the bytes in hex
//
// JournalSession reads the journals.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/bytes.h"
#include "protocols/common/clock.h"
#include "protocols/conversation.h"
#include "protocols/set4tm/archive/background_job.h"

namespace baudgate::protocols::set4tm {

struct Journal {
  enum class Kind : std::uint8_t {
    interval,    ///< begin and end
    correction,  ///< the clock before and behind it
    moment,      ///< one time
    status,      ///< a time, two bytes in reserve, the status word
  };
  std::uint8_t number = 0;
  Kind kind = Kind::interval;
  bool urgent = false;  ///< read before others
  std::string_view name{};
};

/// Those whose records the reference lays out; the urgent ones first.
std::span<const Journal> Journals();

/// 10 · journal + 1 for what begins, or has happened; + 2 for its end.
constexpr std::uint32_t BeginCode(const Journal& journal) { return journal.number * 10U + 1; }
constexpr std::uint32_t EndCode(const Journal& journal) { return journal.number * 10U + 2; }
/// Records may be missing.
constexpr std::uint32_t GapCode(const Journal& journal) { return journal.number * 10U + 9; }

/// Asks for one record, 0 being the oldest: 04 where that can name it, else 09.
Bytes JournalRequest(const Journal& journal, std::size_t record);
/// Nothing was written here yet: all zeros, or all ones (inferred).
bool IsEmpty(View record);
/// `record` is what `before` has become: what was under way has ended.
bool HasEnded(View before, View record);

struct JournalReader {
  std::optional<CivilZone> zone{};  ///< empty: events have no time, and their texts the civil one
  bool knows_status = false;        ///< the bits of the status word are those of the reference
  /// `before`: the record as it was when its events were taken; empty: none were.
  std::vector<DeviceEvent> EventsOf(const Journal& journal, View record, View before) const;

 private:
  DeviceEvent At(std::uint32_t code, CivilZone::Civil civil, std::string text) const;
};

// The job that reads the journals of a meter, so that each record is reported once. Reading takes
// nothing away: the meter keeps its last records. What was reported already is known from what the
// store of events holds (Conversation::OnEventsKept). What is kept of each journal is its records:
//
//   9020001 01:31301501….-;07:-.-
//
// How they are read:
//
//   a journal that is not known, or after a reconnect, and once an hour     all its records
//   in between, one after the other, urgent ones every other time           its newest record;
//                                                                           another one: all, soon
//   all records         from the oldest to the newest, then back: replies carry no number, and one
//                       that is late, or a record that came meanwhile, makes the two differ; then
//                       once more
//   what both say alike, and is not among what is kept                      events
//
// Records are told apart by their bytes alone, those that are equal by how many there are: neither
// a clock that was set nor another order of the records matters.
class JournalSession {
 public:
  /// So many exchanges a task of events has at most, where a journal has something new; else one.
  static constexpr int kMostExchanges = 4;
  static constexpr Duration kWholeEvery = std::chrono::hours(1);
  /// After that many failures in a row a journal is left in peace.
  static constexpr int kMostFailures = 3;

  /// `wanted`: the configuration asks for events. `records`: of each journal.
  JournalSession(bool wanted, std::size_t records);

  /// It is known what is kept, and the meter has not refused all journals.
  bool has_events() const;
  /// All of them.
  bool has_refused() const;
  /// See Conversation::OnEventsKept.
  void OnKept(std::string_view said);
  /// The serial number of the meter that answers.
  void OnMeter(std::uint32_t serial);

  /// has_events(): the PDU to be sent next; the same until it is answered or has failed.
  Bytes Next(Instant now);
  /// It answers the PDU of Next.
  Answer Take(View record, const JournalReader& reader, Instant now);
  /// The meter does not give this record: `answer` says why.
  Answer TakeRefusal(Answer answer, Instant now);
  void OnFailure(Outcome outcome, Instant now);
  void OnReconnect();
  void ForgetRefusals();

 private:
  using Records = std::vector<Bytes>;  // by their places in the journal

  struct State {
    const Journal* journal = nullptr;
    std::optional<Records> kept;  // empty: the journal was never read
    std::size_t records = 0;      // it has so many
    bool refused = false;
    bool due = true;  // to be read whole
    Instant read_at{};
    int failures = 0;
    Instant rests_until{};
    bool beyond = true;  // the next look is behind the newest record, else at it
  };
  /// A journal that is being read whole.
  struct Pass {
    std::size_t state = 0;
    Records records{};  // of this time, as far as they came
    bool backwards = false;
    bool soon = false;                // it has something new
    std::optional<Records> before{};  // of the last time, the other way round
    int times = 0;
  };

  void Choose(Instant now);
  bool Begin(Instant now);
  bool LookAt(bool urgent, Instant now);
  bool MayAsk(const State& state, Instant now) const;
  static std::size_t PlaceToLook(const State& state);
  Answer OnLook(State& state, View record);
  Answer OnWhole(State& state, Records records, const JournalReader& reader, Instant now);
  Answer Report(State& state, Records records, const JournalReader& reader, Instant now);
  Answer GoOn();
  Answer End(Answer answer = {});
  std::string Said(const State& instead, const Records& records) const;

  const bool wanted_;
  const std::size_t records_;
  bool recalled_ = false;
  KeptMeter meter_;
  std::vector<State> states_;
  std::optional<Pass> pass_;
  std::size_t asked_ = 0;  // whose record was asked for
  std::size_t place_ = 0;  // and which
  bool looks_ = false;     // it is not of the pass
  bool chosen_ = false;    // the task under way has a record to ask for
  int exchanges_ = 0;      // of that task, answered
  unsigned turn_ = 0;
  std::size_t urgent_turn_ = 0;
  std::size_t other_turn_ = 0;
};

}  // namespace baudgate::protocols::set4tm
