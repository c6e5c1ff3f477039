// Evidence holds what is known of a device or a line that does not work as it should: the facts of
// the latest exchanges, of its own past and of its neighbours, for
// gateway/diagnosis/causes/hypotheses.h. Pure. FindAbsences tells single losses from outages, and
// Coincidences counts the failures of one device that stand where another one fails as well.
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

// Does a device that fails now and then lose single requests, or is it away for some time and comes
// back? Losses hit one exchange like another; outages put failures together. Pure.
//
//   o x o o x o x x o o o o x o     losses: failures stand as chance puts them
//   o o o o o x x x x o o o o o     an outage: by chance they would hardly ever stand so

/// How all exchanges ended that the runs stand for.
struct FailureTally {
  double failed = 0;
  double answered = 0;
  double runs = 0;
  double longest = 0;  ///< failures in a row
};

FailureTally TallyOf(const bus::FailureRuns& failures);

struct Absences {
  std::size_t times = 0;             ///< it has come back
  Duration length{};                 ///< of one, on the average; about
  std::optional<Duration> period{};  ///< from one beginning to the next, where that is regular
};

/// Nothing: single losses, or it has been away once and is so still.
std::optional<Absences> FindAbsences(const bus::FailureRuns& failures);
/// Again and again both fail in a row at the same time.
bool AreAwayTogether(const bus::FailureRuns& one, const bus::FailureRuns& other);

/// Failures of one device that stand where another one fails as well.
struct Coincidences {
  std::size_t all = 0;  ///< failures of the one, repeats apart
  std::size_t together = 0;
  double expected = 0;  ///< so many would be together by chance

  bool AreNoChance() const;
  void Add(const Coincidences& more) {
    all += more.all;
    together += more.together;
    expected += more.expected;
  }
};
Coincidences CoincidencesOf(const bus::FailureRuns& one, const bus::FailureRuns& other);

/// From one failure of any of them to the next, where these come regularly and strike several
/// devices, or now one and now another: an outage that they share may be as short as one request.
std::optional<Duration> SharedPeriod(std::span<const bus::FailureRuns* const> devices);
/// It is silent now, and no longer than its failures have lasted before.
bool IsUsualSilence(const bus::FailureRuns& failures, Instant now);

struct Evidence {
  const config::Line* line = nullptr;
  const bus::LineStatus* status = nullptr;
  const bus::DeviceRecord* device = nullptr;  ///< null: of all devices of the line together
  Instant now{};
  bool absent = false;    ///< it does not answer at present
  bool answered = false;  ///< it has, since the start
  bool changed = false;   ///< it has, and to none of the exchanges that are kept
  std::string healthy{};  ///< a neighbour that answers well; empty: none
  std::string alike{};    ///< a neighbour that fails in the same way; empty: none
  std::string missing{};  ///< a neighbour from which not a byte ever came; empty: none
  bool noisy = false;     ///< replies of a neighbour come damaged about as often
  std::string away{};     ///< neighbours that are away at the same times: "d, e"; empty: none
  std::string losing{};   ///< neighbours that lose requests at the same times; empty: none
  std::optional<Duration> shared_period{};  ///< of those losses, where they come regularly
  std::string fell{};               ///< neighbours that fell silent with it: "d, e"; empty: none
  const Finding* master = nullptr;  ///< another master of the line, heard twice; null: none
  /// XON and XOFF (bits of kSpecialBytes), where all requests of the line to which nothing comes,
  /// while others are answered, have one of them, two at least, and none that was answered.
  std::uint8_t eaten = 0;
  std::size_t looked = 0;  ///< the latest exchanges
  std::size_t failed = 0;  ///< of those, without a good reply
  std::size_t seen = 0;    ///< failures that `counts` stands for, older ones among them
  bus::Findings::Counts counts{};
  std::array<const Finding*, kSymptoms> last{};

  std::size_t Count(Symptom symptom) const { return counts[static_cast<std::size_t>(symptom)]; }
  std::size_t Count(std::initializer_list<Symptom> symptoms) const;
  /// The part of the failures that had one of these symptoms.
  double Share(std::initializer_list<Symptom> symptoms) const;
  /// The share of the failures that had one of the symptoms `own` or `others`. The symptoms
  /// `others` may have the same cause; they do not count if they are more than `most` times as many
  /// as `own`.
  double Share(std::initializer_list<Symptom> own, std::initializer_list<Symptom> others,
               std::size_t most = 4) const;
  const Finding& Last(Symptom symptom) const { return *last[static_cast<std::size_t>(symptom)]; }
  /// The last words for people that came; empty: none.
  const Finding& Words() const {
    const Finding& alone = Last(Symptom::text);
    return alone.cause.empty() ? Last(Symptom::text_beside) : alone;
  }
  /// The times, address and serial settings are those of the device, or of the first one.
  const bus::DeviceRecord& first() const { return *records.front(); }
  const config::Traits& traits() const { return *first().device->traits; }

  std::vector<const bus::DeviceRecord*> records{};
};

/// The evidence about one device; `all`: the devices of its line, which outlive the evidence.
Evidence Gather(const bus::LineStatus& status, const bus::DeviceRecord& device,
                std::span<const bus::DeviceRecord> all, Now now);
/// The same about all devices of the line that are in use and do not answer.
Evidence GatherAbsent(const bus::LineStatus& status, std::span<const bus::DeviceRecord> all,
                      Now now);

/// Once may be chance.
inline constexpr std::size_t kFacts = 2;

/// A request that has failed so often in a row, beside others that are answered.
inline constexpr std::uint32_t kNeverAnswered = 3;

/// So often in vain, one poll after another, it is no chance.
inline constexpr std::uint32_t kNeverByChance = 8;

/// A request of the polls has failed so often in a row, beside others that are answered.
bool HasDeadQuery(const bus::DeviceRecord& record, std::uint32_t in_vain = kNeverByChance);

/// Something came, and is no reply as it is.
bool IsDamage(Symptom symptom);

/// Its own, or those of its line.
config::SerialSettings SerialOf(const bus::DeviceRecord& record);

/// How many of its latest exchanges had no good reply.
std::size_t FailedOf(const bus::DeviceStatus& status);

/// More than one device is in use, and none of them answers.
bool AbsentTogether(std::span<const bus::DeviceRecord> all);
/// Asked, and not there.
bool IsAbsent(const bus::DeviceStatus& status);
/// Even if it counts as offline right now.
bool HasAnsweredLately(const bus::DeviceStatus& status, Instant now);
/// An adapter gives back each request.
bool Echoes(const bus::LineStatus& status);

}  // namespace baudgate::diagnosis
