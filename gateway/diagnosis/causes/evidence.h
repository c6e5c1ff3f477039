// `Evidence` contains the facts about a device or a line with trouble: its latest exchanges, its
// past and its neighbours (the other devices of the line). The hypotheses (hypotheses.h) judge
// these facts. FindAbsences distinguishes single losses from outages. Coincidences counts failures
// of one device that happen together with failures of another. No function does I/O or reads a
// clock.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>

#include "gateway/base/finding.h"
#include "gateway/base/time.h"
#include "gateway/bus/points/device_status.h"
#include "gateway/bus/points/line_status.h"
#include "gateway/bus/points/point_store.h"

namespace baudgate::diagnosis {

// FindAbsences decides whether a device that fails now and then loses single requests, or is away
// at times (outages). Losses are distributed at random; in an outage failures follow each other:
//
//   o x o o x o x x o o o o x o     losses: the failures are distributed at random
//   o o o o o x x x x o o o o o     an outage: random failures would hardly ever be this close
//

/// Sums over all stored runs of failures of a device, and over the answered exchanges between them.
struct FailureTally {
  double failed = 0;
  double answered = 0;
  double runs = 0;
  double longest = 0;  ///< failures in the longest run
};

FailureTally TallyOf(const bus::FailureRuns& failures);

struct Absences {
  std::size_t times = 0;  ///< number of outages that have ended
  Duration length{};      ///< estimated average length of an outage
  /// Time from the beginning of an outage to the beginning of the next. Nothing: it varies.
  std::optional<Duration> period{};
};

/// Returns the outages of a device. Nothing: its failures are single losses, or its first outage
/// has not ended.
std::optional<Absences> FindAbsences(const bus::FailureRuns& failures);
/// True if both devices repeatedly have runs of failures at the same times.
bool AreAwayTogether(const bus::FailureRuns& one, const bus::FailureRuns& other);

/// How many runs of failures of one device happen while another device fails too.
struct Coincidences {
  std::size_t all = 0;  ///< number of runs of failures of the first device
  std::size_t together = 0;
  double expected = 0;  ///< value of `together` to expect if the devices fail independently

  bool AreNoChance() const;
  void Add(const Coincidences& more) {
    all += more.all;
    together += more.together;
    expected += more.expected;
  }
};
Coincidences CoincidencesOf(const bus::FailureRuns& one, const bus::FailureRuns& other);

/// Returns the period of regular outages that several devices share, at the same time or one after
/// the other. An outage can be as short as one request. Nothing: there are no such outages.
std::optional<Duration> SharedPeriod(std::span<const bus::FailureRuns* const> devices);
/// True if the device is silent now, was silent at least twice before, and is not silent for more
/// than twice its longest silence before.
bool IsUsualSilence(const bus::FailureRuns& failures, Instant now);

struct Evidence {
  const config::Line* line = nullptr;
  const bus::LineStatus* status = nullptr;
  /// The device in question. Null: the evidence is about all absent devices of the line.
  const bus::DeviceRecord* device = nullptr;
  Instant now{};
  bool absent = false;    ///< the device does not answer at present
  bool answered = false;  ///< the device has answered since the start
  bool changed = false;   ///< the device has answered, but in none of the stored exchanges
  std::string healthy{};  ///< name of a neighbour that answers well; empty: no neighbour does
  std::string alike{};  ///< name of a neighbour whose failures look the same; empty: there is none
  std::string missing{};  ///< name of a neighbour that has never sent a byte; empty: all have
  /// Replies of a neighbour come damaged about as often as those of the device.
  bool noisy = false;
  std::string away{};    ///< neighbours with outages at the same times, such as "d, e"; or empty
  std::string losing{};  ///< neighbours that lose requests at the same times; or empty
  /// The period of the losses in `losing`; nothing: they are irregular.
  std::optional<Duration> shared_period{};
  /// Neighbours that stopped answering at the same time, such as "d, e"; empty: there are no such
  /// neighbours.
  std::string fell{};
  /// The latest finding about another master; null: another master was seen less than twice.
  const Finding* master = nullptr;
  /// XON and XOFF (as bits of kSpecialBytes) that a converter seems to remove from requests: at
  /// least two polls get no answer, each of them contains one of these bytes, and no answered
  /// request does.
  std::uint8_t eaten = 0;
  std::size_t looked = 0;  ///< number of stored exchanges (at most 32 for each device)
  std::size_t failed = 0;  ///< number of stored exchanges without a good reply
  /// Number of failures in `counts`; includes exchanges that are no longer stored.
  std::size_t seen = 0;
  bus::Findings::Counts counts{};
  std::array<const Finding*, kSymptoms> last{};

  std::size_t Count(Symptom symptom) const { return counts[static_cast<std::size_t>(symptom)]; }
  std::size_t Count(std::initializer_list<Symptom> symptoms) const;
  /// Returns which share of the failures had one of these symptoms, 0 to 1.
  double Share(std::initializer_list<Symptom> symptoms) const;
  /// Returns which share of the failures had one of the symptoms `own` or `others`. The symptoms
  /// `others` do not count if they are more than `most` times as frequent as `own`.
  double Share(std::initializer_list<Symptom> own, std::initializer_list<Symptom> others,
               std::size_t most = 4) const;
  const Finding& Last(Symptom symptom) const { return *last[static_cast<std::size_t>(symptom)]; }
  /// Returns the finding with the latest readable text, alone or beside a reply. Its cause is empty
  /// if no text came.
  const Finding& Words() const {
    const Finding& alone = Last(Symptom::text);
    return alone.cause.empty() ? Last(Symptom::text_beside) : alone;
  }
  /// Returns the device, or the first of several, for its times, address and serial settings.
  const bus::DeviceRecord& first() const { return *records.front(); }
  const config::Traits& traits() const { return *first().device->traits; }

  std::vector<const bus::DeviceRecord*> records{};
};

/// Returns the evidence about one device. `all`: the devices of its line, which must stay valid as
/// long as the result.
Evidence Gather(const bus::LineStatus& status, const bus::DeviceRecord& device,
                std::span<const bus::DeviceRecord> all, Now now);
Evidence GatherAbsent(const bus::LineStatus& status, std::span<const bus::DeviceRecord> all,
                      Now now);

/// From this number on, equal observations are not chance.
inline constexpr std::size_t kFacts = 2;

/// A poll that failed this many times in a row while others were answered counts as never answered.
inline constexpr std::uint32_t kNeverAnswered = 3;

/// A poll that failed this many times in a row does not fail by chance.
inline constexpr std::uint32_t kNeverByChance = 8;

/// True if one poll has failed at least `in_vain` times in a row while another poll was answered.
bool HasDeadQuery(const bus::DeviceRecord& record, std::uint32_t in_vain = kNeverByChance);

/// True if the symptom means that bytes came but were not a readable reply.
bool IsDamage(Symptom symptom);

/// Returns the serial settings of the device; if it has none, those of its line.
config::SerialSettings SerialOf(const bus::DeviceRecord& record);

/// Returns how many of the stored exchanges had no good reply.
std::size_t FailedOf(const bus::DeviceStatus& status);

/// True if several devices are in use, none answers, and all seem to fail for one reason.
bool AbsentTogether(std::span<const bus::DeviceRecord> all);
/// True if the device was asked and does not answer at present.
bool IsAbsent(const bus::DeviceStatus& status);
/// True if the device has answered in the last 15 s, even if its state is offline.
bool HasAnsweredLately(const bus::DeviceStatus& status, Instant now);
bool Echoes(const bus::LineStatus& status);

}  // namespace baudgate::diagnosis
