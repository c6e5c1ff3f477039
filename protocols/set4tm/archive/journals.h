// The journals of a meter: their numbers, the layout of their records, and the events in them
// (reference, 8.2). Times are local times of the meter, without a zone. Example: a record of
// journal 07 has the begin (event 71, BeginCode) and the end (event 72, EndCode) of an interval.
//
//   journal 07, 31 30 15 01 02 09 02 · 00 00 00 00 00 00 00    E71 2002-09-02T15:30:31, still open
//            … 31 30 15 01 02 09 02 · 12 32 15 01 02 09 02     E71, E72 2002-09-02T15:32:12
//            … 99 30 15 …                                      E0, the bytes in hex: no valid time
//
// JournalSession reads the journals.
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
    interval,    ///< a record has the times of begin and end
    correction,  ///< a record has the clock times before and after a correction
    moment,      ///< a record has a single time
    status,      ///< a record has a time, two reserved bytes, and the status word
  };
  std::uint8_t number = 0;
  Kind kind = Kind::interval;
  bool urgent = false;  ///< true: new records are looked for more often than in other journals
  std::string_view name{};
};

/// Returns the journals whose records the reference describes; the urgent ones first.
std::span<const Journal> Journals();

/// The event codes of a journal: 10 · journal + 1 for the begin of an interval or a single event,
/// 10 · journal + 2 for an end.
constexpr std::uint32_t BeginCode(const Journal& journal) { return journal.number * 10U + 1; }
constexpr std::uint32_t EndCode(const Journal& journal) { return journal.number * 10U + 2; }
/// The code of the event that records may be missing.
constexpr std::uint32_t GapCode(const Journal& journal) { return journal.number * 10U + 9; }

/// Returns the PDU that asks for a record (0: the oldest). It uses code 04 if possible, else 09.
Bytes JournalRequest(const Journal& journal, std::size_t record);
/// True if the meter has never written the record: all bytes are 00, or all are FF (inferred).
bool IsEmpty(View record);
/// True if `record` is the interval `before`, which had no end and now has one.
bool HasEnded(View before, View record);

struct JournalReader {
  /// Zone of the meter's clock; empty: events have no time, and their texts contain the local time.
  std::optional<CivilZone> zone{};
  /// True: the bits of the status word are known, so the event names the flags; false: its text is
  /// hex.
  bool knows_status = false;
  /// Returns the events in `record`. `before`: the same record as it was last reported; empty: it
  /// was never reported.
  std::vector<DeviceEvent> EventsOf(const Journal& journal, View record, View before) const;

 private:
  DeviceEvent At(std::uint32_t code, CivilZone::Civil civil, std::string text) const;
};

// JournalSession reads the journals of a meter and reports each record once. Reading removes
// nothing: the meter stores its last records. The stored state (Conversation::OnEventsKept) shows
// which records were reported; it contains the records of each journal:
//
//   9020001 01:31301501….-;07:-.-
//
// The order of reading:
//
//   a journal without stored state, after a reconnect, once an hour    all its records
//   otherwise in turn, every other time an urgent journal              the place where a new record
//                                                                      appears; if it has changed,
//                                                                      all records at once
//
// All records are read from the oldest to the newest. If they equal the stored state, nothing is
// new. Otherwise they are read again, backwards, until two readings agree, because replies contain
// no record number: a late reply or a new record makes the readings differ. Records that are not in
// the stored state then become events.
//
// Records are compared by their bytes alone, and equal records are counted, so a changed clock or
// another order of the records does not matter.
class JournalSession {
 public:
  /// The maximum number of exchanges in a task of events if a journal has a new record; without a
  /// new record a task has one exchange.
  static constexpr int kMostExchanges = 4;
  static constexpr Duration kWholeEvery = std::chrono::hours(1);
  /// After this many failures in a row, no records of the journal are requested for kWholeEvery.
  static constexpr int kMostFailures = 3;

  /// `wanted`: true if the configuration asks for events. `records`: number of records in each
  /// journal.
  JournalSession(bool wanted, std::size_t records);

  /// True if events are wanted, the stored state is known, and the meter has not refused all
  /// journals.
  bool has_events() const;
  bool has_refused() const;
  void OnKept(std::string_view said);
  void OnMeter(std::uint32_t serial);

  /// Returns the PDU to send next. Repeated calls return the same PDU until it is answered or has
  /// failed. Call it only if has_events() is true.
  Bytes Next(Instant now);
  Answer Take(View record, const JournalReader& reader, Instant now);
  Answer TakeRefusal(Answer answer, Instant now);
  void OnFailure(Outcome outcome, Instant now);
  void OnReconnect();
  void ForgetRefusals();

 private:
  using Records = std::vector<Bytes>;

  struct State {
    const Journal* journal = nullptr;
    // The records in the stored state; empty: the journal was never read.
    std::optional<Records> kept;
    std::size_t records = 0;
    bool refused = false;
    bool due = true;  // true: all records must be read
    Instant read_at{};
    int failures = 0;
    Instant rests_until{};
    // True: the next look reads the position after the newest record; false: the newest record.
    bool beyond = true;
  };
  /// The reading of all records of a journal, under way.
  struct Pass {
    std::size_t state = 0;
    Records records{};  // the records that were read so far, in the order of reading
    bool backwards = false;
    bool soon = false;  // true: a new record was found, so the reading goes on without a pause
    // The records of the previous, complete reading; empty: this is the first reading.
    std::optional<Records> before{};
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
  std::size_t asked_ = 0;
  std::size_t place_ = 0;
  bool looks_ = false;   // true: the request looks for a new record and is not part of pass_
  bool chosen_ = false;  // true: a journal was chosen for the task under way
  int exchanges_ = 0;    // number of answered exchanges in the task under way
  unsigned turn_ = 0;
  std::size_t urgent_turn_ = 0;
  std::size_t other_turn_ = 0;
};

}  // namespace baudgate::protocols::set4tm
