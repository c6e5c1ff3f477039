// Evidence contains the facts about a device or a line with trouble: its latest exchanges, its past
// and its neighbours. The hypotheses of gateway/diagnosis/causes/hypotheses.h judge them.
// FindAbsences tells single losses from outages; Coincidences counts failures of one device that
// happen together with failures of another device. All functions are pure.
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

// Tells whether a device that fails now and then loses single requests or is sometimes away. Losses
// are distributed at random; an outage puts failures together.
//
//   o x o o x o x x o o o o x o     losses: the failures are distributed at random
//   o o o o o x x x x o o o o o     an outage: random failures would hardly ever be this close
//

/// How the exchanges of all runs ended.
struct FailureTally {
  double failed = 0;
  double answered = 0;
  double runs = 0;
  double longest = 0;  ///< the longest run of failures
};

FailureTally TallyOf(const bus::FailureRuns& failures);

struct Absences {
  std::size_t times = 0;             ///< outages that are over
  Duration length{};                 ///< the average length of one outage, estimated
  std::optional<Duration> period{};  ///< from one beginning to the next; nothing: irregular
};

/// Returns nothing for single losses, and for a first outage that is not over yet.
std::optional<Absences> FindAbsences(const bus::FailureRuns& failures);
/// True if both devices repeatedly have runs of failures at the same time.
bool AreAwayTogether(const bus::FailureRuns& one, const bus::FailureRuns& other);

/// How many failures of one device happen while another device fails as well.
struct Coincidences {
  std::size_t all = 0;  ///< runs of failures of the first device
  std::size_t together = 0;
  double expected = 0;  ///< the number of coincidences that chance alone would give

  bool AreNoChance() const;
  void Add(const Coincidences& more) {
    all += more.all;
    together += more.together;
    expected += more.expected;
  }
};
Coincidences CoincidencesOf(const bus::FailureRuns& one, const bus::FailureRuns& other);

/// The time between regular outages that several devices share, together or one after the other; an
/// outage may be as short as one request. Nothing: there are none.
std::optional<Duration> SharedPeriod(std::span<const bus::FailureRuns* const> devices);
/// True if the device has been silent for at most twice as long as its longest silence before.
bool IsUsualSilence(const bus::FailureRuns& failures, Instant now);

struct Evidence {
  const config::Line* line = nullptr;
  const bus::LineStatus* status = nullptr;
  /// Null: the evidence is about all absent devices of the line.
  const bus::DeviceRecord* device = nullptr;
  Instant now{};
  bool absent = false;    ///< the device does not answer at present
  bool answered = false;  ///< the device has answered since the start
  bool changed = false;   ///< the device has answered, but not in any of the stored exchanges
  std::string healthy{};  ///< a neighbour that answers well; empty: none
  std::string alike{};    ///< a neighbour whose failures look the same; empty: none
  std::string missing{};  ///< a neighbour that has never sent a byte; empty: none
  bool noisy = false;     ///< replies of a neighbour come damaged about as often
  std::string away{};     ///< neighbours with outages at the same times: "d, e"; empty: none
  std::string losing{};   ///< neighbours that lose requests at the same times; empty: none
  std::optional<Duration> shared_period{};  ///< the period of these losses; nothing: irregular
  /// Neighbours that stopped answering at the same moment: "d, e"; empty: none.
  std::string fell{};
  /// The latest finding about another master, seen at least twice; null: none.
  const Finding* master = nullptr;
  /// XON and XOFF (bits of kSpecialBytes) that a converter seems to take out of requests: at least
  /// two requests get no answer, each contains one of them, and no answered request does.
  std::uint8_t eaten = 0;
  std::size_t looked = 0;  ///< the number of latest exchanges
  std::size_t failed = 0;  ///< exchanges of `looked` without a good reply
  std::size_t seen = 0;    ///< failures that `counts` contains, including older ones
  bus::Findings::Counts counts{};
  std::array<const Finding*, kSymptoms> last{};

  std::size_t Count(Symptom symptom) const { return counts[static_cast<std::size_t>(symptom)]; }
  std::size_t Count(std::initializer_list<Symptom> symptoms) const;
  /// The share of the failures that had one of these symptoms.
  double Share(std::initializer_list<Symptom> symptoms) const;
  /// The share of the failures that had one of the symptoms `own` or `others`. The symptoms
  /// `others` are ignored if they are more than `most` times as frequent as `own`.
  double Share(std::initializer_list<Symptom> own, std::initializer_list<Symptom> others,
               std::size_t most = 4) const;
  const Finding& Last(Symptom symptom) const { return *last[static_cast<std::size_t>(symptom)]; }
  /// The latest text for people, alone or beside a reply; without a cause if none came.
  const Finding& Words() const {
    const Finding& alone = Last(Symptom::text);
    return alone.cause.empty() ? Last(Symptom::text_beside) : alone;
  }
  /// The device, or the first of several devices. Use its times, address and serial settings.
  const bus::DeviceRecord& first() const { return *records.front(); }
  const config::Traits& traits() const { return *first().device->traits; }

  std::vector<const bus::DeviceRecord*> records{};
};

/// The evidence about one device. `all`: the devices of its line, which must outlive the evidence.
Evidence Gather(const bus::LineStatus& status, const bus::DeviceRecord& device,
                std::span<const bus::DeviceRecord> all, Now now);
/// Collects the evidence about all absent devices of the line together.
Evidence GatherAbsent(const bus::LineStatus& status, std::span<const bus::DeviceRecord> all,
                      Now now);

/// A single exchange may be chance.
inline constexpr std::size_t kFacts = 2;

/// A poll that failed this often in a row while others are answered is never answered.
inline constexpr std::uint32_t kNeverAnswered = 3;

/// A poll that failed this often in a row does not fail by chance.
inline constexpr std::uint32_t kNeverByChance = 8;

/// True if one poll has failed at least `in_vain` times in a row and another poll is answered.
bool HasDeadQuery(const bus::DeviceRecord& record, std::uint32_t in_vain = kNeverByChance);

/// True for symptoms of bytes that came but are not a readable reply.
bool IsDamage(Symptom symptom);

/// The serial settings of the device, or of its line if the device has none.
config::SerialSettings SerialOf(const bus::DeviceRecord& record);

/// How many of the latest exchanges had no good reply.
std::size_t FailedOf(const bus::DeviceStatus& status);

/// True if several devices are in use, none answers, and all seem to fail for the same reason.
bool AbsentTogether(std::span<const bus::DeviceRecord> all);
/// True if the device has been asked and does not answer.
bool IsAbsent(const bus::DeviceStatus& status);
/// True if the device has answered in the last 15 s, even if its state is offline.
bool HasAnsweredLately(const bus::DeviceStatus& status, Instant now);
/// True if an adapter returns each request.
bool Echoes(const bus::LineStatus& status);

}  // namespace baudgate::diagnosis
