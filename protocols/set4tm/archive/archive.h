// What a meter keeps itself: journals, which are events, and load profiles and billing readings,
// which are read in the background: LoadSession and BillingSession. Joins the three jobs, and what
// is kept of each in one text (KeptTexts).
// SPDX-License-Identifier: Apache-2.0
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

// The job that reads the load profiles of one meter. What is kept of each profile is the place up
// to which it was read (load_profile.h):
//
//   9020001 1:0658:1414080200023437:30;2:0000:1314080200023337:2
//

class LoadSession final : public BackgroundJob {
 public:
  /// Between looks whether there is something new.
  static constexpr Duration kLook = std::chrono::minutes(5);

  explicit LoadSession(const Settings& settings);

  bool wanted() const override { return !states_.empty(); }
  void OnMeter(std::uint32_t serial) override;
  void OnType(std::optional<std::uint8_t> type) override;
  void OnFailure(Instant now) override;
  void OnReconnect() override;
  void ForgetRefusals() override;
  /// "load_1 read to 2026-11-23T10:30:00.000Z".
  std::string Shown() const override;

 private:
  struct State {
    LoadReader reader;
    Instant due{};
    bool refused = false;
    std::string kept{};  // the place that is on the disk
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
  bool tagged_ = true;  // it knows 0C, or that is not known yet
  bool blind_ = false;  // its constants are not known
  std::uint8_t id_ = 0;
  std::size_t asked_ = 0;
};

// Billing readings of one meter: its energies, in sum and by tariffs, at the begin of each day or
// month, taken out of what the meter keeps itself (0A 86, 0A 83; reference, 8.4), so that an outage
// of the gateway leaves nothing out that the meter still has: eleven months and the present one,
// 27 days and today. Replies say neither month nor tariff: a reading counts when it was read twice,
// the second time backwards, and when it was the same day by the meter before and behind it.
//
//   month 2026-11-01;day 2026-11-23        what is kept: the newest of each
//
// Another meter at its place goes on where the last has ended: what is before is another site's.

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
    std::optional<Day> kept{};   // the newest that is on the disk
    std::optional<Day> empty{};  // up to here the meter has nothing more
    bool refused = false;
    Instant rests_until{};  // what has just begun may not be there yet
  };
  /// A reading under way: the day by the meter, registers of all tariffs forwards and backwards,
  /// and the day once more.
  struct Pass {
    std::size_t period = 0;
    Day begin{};
    std::vector<Bytes> registers{};  // by tariff; empty: the meter does not know it
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
  /// The reading under way asks for registers, not for the day.
  bool reads_registers() const { return today_ && pass_ && pass_->step < 2 * tariffs(); }
  Answer OnDay(Day day, const Scale& scale);
  void OnRegister(View data);
  /// The reading under way is whole.
  Answer Finish(const Scale& scale);
  std::string Said(BillingPeriod kind, Day day) const;

  const CivilZone zone_;
  const std::size_t tariffs_;
  std::vector<Period> periods_;
  std::optional<Day> today_;  // by the meter, in this look
  std::optional<Pass> pass_;
  Instant due_{};
};

// What a batch of a meter's conversation says (EventBatch::said) has a part for each kind of what
// is kept: "journals|load profiles|billing readings". A batch brings one kind, and says of the
// others what is kept.
class KeptTexts {
 public:
  static constexpr std::size_t kJournals = 0;
  static constexpr std::size_t kParts = 3;

  /// Which parts are others now; at first all.
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

  /// `answer`, whose batch, where it has one, says only that part.
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
  /// `events`: the configuration asks for them. The others outlive it.
  MeterArchive(bool events, const Settings& settings, Identification& identification);

  bool has_events() const { return journals_.has_events(); }
  /// What is kept says of which meter it is.
  bool wants_serial() const { return has_events() || loads_.wanted(); }
  /// From when on a task in the background is wanted; empty: it is not.
  std::optional<Instant> due() const;
  bool IsDue(Instant now) const;
  /// See Conversation::OnEventsKept.
  void OnKept(std::string_view said);
  /// The serial number of the meter that answers.
  void OnMeter(std::uint32_t serial);
  void OnReconnect();
  /// `journals`: those as well. A journal that was never read may be missing for ever.
  void ForgetRefusals(bool journals);

  // Tasks of events: the next PDU, its data, its refusal, no answer to it.

  Bytes NextRecord(Instant now) { return journals_.Next(now); }
  Answer TakeRecord(View data, Instant now);
  Answer TakeNoRecord(Answer answer, Instant now);
  void OnNoRecord(Outcome outcome, Instant now) { journals_.OnFailure(outcome, now); }

  // Tasks in the background.

  /// What has to be asked before NextInBackground; empty: it may be sent.
  std::optional<Bytes> Question();
  Bytes NextInBackground(Instant now);
  Answer TakeInBackground(View data, Instant now);
  Answer TakeRefusal(Answer answer, Instant now) {
    return job().TakeRefusal(std::move(answer), now);
  }
  /// The task did not bring what it was for.
  void OnFailure(Instant now) { job().OnFailure(now); }

  /// For the status; empty: nothing was learned.
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
  std::size_t job_ = 0;  // of the latest task in the background
};

}  // namespace baudgate::protocols::set4tm
