// The journals of a meter: their numbers, the layout of their records, and the events in them
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
    interval,    ///< times of begin and end
    correction,  ///< clock times before and after a correction
    moment,      ///< one time
    status,      ///< a time, two reserved bytes, the status word
  };
  std::uint8_t number = 0;
  Kind kind = Kind::interval;
  bool urgent = false;  ///< read more often than other journals
  std::string_view name{};
};

/// Returns the journals whose records the reference describes; the urgent ones first.
std::span<const Journal> Journals();

/// Event codes: 10 · journal + 1 for a begin or a single event, + 2 for an end.
constexpr std::uint32_t BeginCode(const Journal& journal) { return journal.number * 10U + 1; }
constexpr std::uint32_t EndCode(const Journal& journal) { return journal.number * 10U + 2; }
/// Event code for a gap: records may be missing.
constexpr std::uint32_t GapCode(const Journal& journal) { return journal.number * 10U + 9; }

/// Returns the PDU that asks for one record (0: the oldest). It uses 04 if possible, else 09.
Bytes JournalRequest(const Journal& journal, std::size_t record);
/// True if the record was never written: all zeros, or all ones (inferred).
bool IsEmpty(View record);
/// True if `record` is the interval `before`, which was open and now has an end.
bool HasEnded(View before, View record);

struct JournalReader {
  std::optional<CivilZone> zone{};  ///< empty: events have civil times, in their texts only
  bool knows_status = false;  ///< the bits of the status word have the meaning in the reference
  /// Returns the events in `record`. `before`: the record as last reported; empty: never reported.
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
// The reading rules:
//
//   a journal without stored state, after a reconnect, once an hour    all its records
//   otherwise in turn, every other time an urgent journal              its newest record; if it has
//                                                                      changed, all records at once
//
// All records are read from the oldest to the newest and then backwards. Replies contain no record
// number, so a late reply or a new record makes the two readings differ; the journal is then read
// again. Records in which both readings agree, and which are not in the stored state, become
// events.
//
// Records are compared by their bytes alone, and equal records are counted, so a changed clock or
// another order of the records does not matter.
class JournalSession {
 public:
  /// The most exchanges of a task of events if a journal has a new record; otherwise one.
  static constexpr int kMostExchanges = 4;
  static constexpr Duration kWholeEvery = std::chrono::hours(1);
  /// After this many failures in a row a journal is paused.
  static constexpr int kMostFailures = 3;

  /// `wanted`: the configuration asks for events. `records`: number of records in each journal.
  JournalSession(bool wanted, std::size_t records);

  /// True if the stored state is known, and the meter has not refused all journals.
  bool has_events() const;
  bool has_refused() const;
  /// See Conversation::OnEventsKept.
  void OnKept(std::string_view said);
  void OnMeter(std::uint32_t serial);

  /// Returns the PDU to send next, until it is answered or has failed. Call only if has_events().
  Bytes Next(Instant now);
  Answer Take(View record, const JournalReader& reader, Instant now);
  Answer TakeRefusal(Answer answer, Instant now);
  void OnFailure(Outcome outcome, Instant now);
  void OnReconnect();
  void ForgetRefusals();

 private:
  using Records = std::vector<Bytes>;  // index: place in the journal

  struct State {
    const Journal* journal = nullptr;
    std::optional<Records> kept;  // the stored records; empty: the journal was never read
    std::size_t records = 0;      // number of records in the journal
    bool refused = false;
    bool due = true;  // all records are to be read
    Instant read_at{};
    int failures = 0;
    Instant rests_until{};
    bool beyond = true;  // look after the newest record next, else at it
  };
  /// A reading of all records of a journal.
  struct Pass {
    std::size_t state = 0;
    Records records{};  // records of the present reading so far
    bool backwards = false;
    bool soon = false;                // a new record was found: read on without pause
    std::optional<Records> before{};  // records of the previous reading, in the other direction
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
  std::size_t asked_ = 0;  // journal of the latest request
  std::size_t place_ = 0;  // place of the requested record
  bool looks_ = false;     // the request is a look at one record, not part of pass_
  bool chosen_ = false;    // the task under way has chosen its journal
  int exchanges_ = 0;      // answered exchanges of the task under way
  unsigned turn_ = 0;
  std::size_t urgent_turn_ = 0;
  std::size_t other_turn_ = 0;
};

}  // namespace baudgate::protocols::set4tm
