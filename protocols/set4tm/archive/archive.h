// MeterArchive reads the records that a meter stores. Journals become events (JournalSession). Load
// profiles (LoadSession) and billing readings (BillingSession) are read in the background. The
// stored states of these three jobs are joined in one text (KeptTexts).
#pragma once

#include <array>
#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocols/conversation.h"
#include "protocols/set4tm/archive/background_job.h"
#include "protocols/set4tm/archive/journals.h"
#include "protocols/set4tm/archive/load_profile.h"
#include "protocols/set4tm/meter/identification.h"
#include "protocols/set4tm/meter/settings.h"

namespace baudgate::protocols::set4tm {

// LoadSession reads the load profiles of one meter. Its stored state has the meter's serial number,
// and for each profile its number and the position (LoadPlace) up to which it was read:
//
//   9020001 1:0658:1414080200023437:30;2:0000:1314080200023337:2

class LoadSession final : public BackgroundJob {
 public:
  /// Pause between two requests for new records.
  static constexpr Duration kLook = std::chrono::minutes(5);

  explicit LoadSession(const Settings& settings);

  bool wanted() const override { return !states_.empty(); }
  void OnMeter(std::uint32_t serial) override;
  void OnType(std::optional<std::uint8_t> type) override;
  void OnFailure(Instant now) override;
  void OnReconnect() override;
  void ForgetRefusals() override;
  /// Returns a text for the status: "load_1 is read up to 2026-11-23T10:30:00.000Z".
  std::string Shown() const override;

 private:
  struct State {
    LoadReader reader;
    Instant due{};
    bool refused = false;
    std::string kept{};  // text of the position (LoadPlace::Text) that is stored on the disk
  };

  std::optional<Instant> NextDue() const override;
  void Recall(std::string_view said) override;
  Bytes NextPdu() override;
  Answer TakeData(View data, const Scale& scale) override;
  Answer Refused(Answer answer) override;
  void Keep(State& state, std::string_view place, bool another);
  std::string Said(const State& instead, const LoadPlace& place) const;
  LoadReader::Manner manner() const { return {most_, !tagged_}; }

  std::vector<State> states_;
  KeptMeter meter_;
  std::size_t most_ = 16;
  bool tagged_ = true;  // true: memory is read by 0C; false: the meter has refused 0C
  bool blind_ = false;  // true: the meter's constants are unknown, so records cannot be converted
  std::uint8_t id_ = 0;
  std::size_t asked_ = 0;
};

// BillingSession reads the billing readings of one meter: its energies, in sum and by tariff, at
// the beginning of each day or month. It reads them from the meter's archive (0A 86, 0A 83;
// reference, 8.4), so an outage of the gateway loses nothing that the meter still stores: the
// present month and eleven before, today and 27 days before. Replies contain neither month nor
// tariff. So all registers are read twice, the second time in reverse order, and accepted only if
// both results are equal and the meter's date has not changed meanwhile.
//
//   month 2026-11-01;day 2026-11-23        the stored state: the newest month and day that were
//   read
//
// If the meter is replaced, readings of the new meter continue after the last stored reading: its
// older readings belong to another site.

class BillingSession final : public BackgroundJob {
 public:
  static constexpr Duration kLook = std::chrono::minutes(10);

  explicit BillingSession(const Settings& settings);

  bool wanted() const override { return !periods_.empty(); }
  void OnFailure(Instant now) override;
  void OnReconnect() override;
  void ForgetRefusals() override;
  std::string Shown() const override;

 private:
  using Day = std::chrono::local_days;

  struct Period {
    BillingPeriod kind = BillingPeriod::month;
    std::optional<Day> kept{};   // the newest reading that is stored on the disk
    std::optional<Day> empty{};  // the meter has no readings up to this day
    bool refused = false;
    // No readings of this kind are requested before this time. Set when the reading of a period
    // that began today was blank, or when the constants for energy are not known yet.
    Instant rests_until{};
  };
  /// A billing reading under way. Its steps: the date, the registers of the sum and of each tariff,
  /// the same registers in reverse order, the date.
  struct Pass {
    std::size_t period = 0;
    Day begin{};
    // Index: tariff, 0 for the sum; an empty entry: the meter does not have the tariff.
    std::vector<Bytes> registers{};
    std::size_t step = 0;
    bool differs = false;
  };

  std::optional<Instant> NextDue() const override;
  void Recall(std::string_view said) override;
  Bytes NextPdu() override;
  Answer TakeData(View data, const Scale& scale) override;
  Answer Refused(Answer answer) override;
  std::optional<Day> NextOf(const Period& period) const;
  bool Choose();
  std::size_t tariffs() const { return tariffs_ + 1; }
  std::size_t TariffOf(std::size_t step) const {
    return step < tariffs() ? step : 2 * tariffs() - 1 - step;
  }
  Bytes RegisterRequest() const;
  /// True if the next request is for registers, not for the date.
  bool reads_registers() const { return today_ && pass_ && pass_->step < 2 * tariffs(); }
  Answer OnDay(Day day, const Scale& scale);
  void OnRegister(View data);
  Answer Finish(const Scale& scale);
  std::string Said(BillingPeriod kind, Day day) const;

  const CivilZone zone_;
  const std::size_t tariffs_;
  std::vector<Period> periods_;
  // The meter's date before the registers are read; empty: not asked yet.
  std::optional<Day> today_;
  std::optional<Pass> pass_;
  Instant due_{};
};

// KeptTexts joins the stored texts of the journals, the load profiles and the billing readings in
// EventBatch::said, separated by '|'. A batch changes one of the texts and repeats the others.
class KeptTexts {
 public:
  static constexpr std::size_t kJournals = 0;
  static constexpr std::size_t kParts = 3;

  /// Takes the stored text. Returns for each part whether it has changed; at the first call all
  /// parts count as changed.
  std::array<bool, kParts> OnKept(std::string_view said) {
    const bool first = !std::exchange(recalled_, true);
    std::array<bool, kParts> changed{};
    for (std::size_t i = 0; i < kParts; ++i) {
      const auto bar = i + 1 == kParts ? std::string_view::npos : said.find('|');
      std::string part(said.substr(0, bar));
      changed[i] = first || part != parts_[i];
      parts_[i] = std::move(part);
      said = bar == std::string_view::npos ? std::string_view() : said.substr(bar + 1);
    }
    return changed;
  }
  const std::string& part(std::size_t part) const { return parts_[part]; }

  /// Returns `answer` with the texts of all jobs in its batch. The batch comes with only one text,
  /// that of the job `part`.
  Answer With(std::size_t part, Answer answer) const {
    if (!answer.batch) return answer;
    std::array<std::string, kParts> parts = parts_;
    parts[part] = std::move(answer.batch->said);
    std::string said = parts[0];
    for (std::size_t i = 1; i < kParts; ++i) said += '|' + parts[i];
    while (said.ends_with('|')) said.pop_back();
    answer.batch->said = std::move(said);
    return answer;
  }

 private:
  std::array<std::string, kParts> parts_;
  bool recalled_ = false;
};

class MeterArchive {
 public:
  /// `events`: true if the configuration asks for events. The references must outlive this object.
  MeterArchive(bool events, const Settings& settings, Identification& identification);

  bool has_events() const { return journals_.has_events(); }
  /// True if the stored state contains the meter's serial number, so the meter must be asked for
  /// it.
  bool wants_serial() const { return has_events() || loads_.wanted(); }
  std::optional<Instant> due() const;
  bool IsDue(Instant now) const;
  void OnKept(std::string_view said);
  void OnMeter(std::uint32_t serial);
  void OnReconnect();
  /// Forgets which requests the meter has refused, so that they are sent again. `journals`: true to
  /// include the requests of journals. Automatic retries leave them out, because a meter may never
  /// have a journal that it has refused.
  void ForgetRefusals(bool journals);

  // The next four functions are for tasks of events. NextRecord returns the PDU to send;
  // TakeRecord, TakeNoRecord and OnNoRecord take its data, its refusal and its failure.

  Bytes NextRecord(Instant now) { return journals_.Next(now); }
  Answer TakeRecord(View data, Instant now);
  Answer TakeNoRecord(Answer answer, Instant now);
  void OnNoRecord(Outcome outcome, Instant now) { journals_.OnFailure(outcome, now); }

  /// Returns the question that must be asked before NextInBackground. Empty: nothing must be asked.
  std::optional<Bytes> Question();
  Bytes NextInBackground(Instant now);
  Answer TakeInBackground(View data, Instant now);
  Answer TakeRefusal(Answer answer, Instant now) {
    return job().TakeRefusal(std::move(answer), now);
  }
  void OnFailure(Instant now) { job().OnFailure(now); }

  /// Returns a text for the status: what was learned about the archive. Empty: nothing was learned.
  std::string Learned() const;

 private:
  BackgroundJob& job() const { return *jobs_[job_]; }

  const bool events_;
  const Settings& settings_;
  Identification& identification_;
  KeptTexts kept_;
  JournalSession journals_;
  LoadSession loads_;
  BillingSession billing_;
  const std::array<BackgroundJob*, 2> jobs_ = {&loads_, &billing_};
  std::size_t job_ = 0;  // index in jobs_ of the latest background task
};

}  // namespace baudgate::protocols::set4tm
