// Billing readings of one meter: its energies, in sum and by tariffs, at the begin of each day or
// month, taken out of what the meter keeps itself (0A 86, 0A 83; reference, 8.4), so that an outage
// of the gateway leaves nothing out that the meter still has: eleven months and the present one,
// 27 days and today. Replies say neither month nor tariff: a reading counts when it was read twice,
// the second time backwards, and when it was the same day by the meter before and behind it.
//
//   month 2026-11-01;day 2026-11-23        what is kept: the newest of each
//
// Another meter at its place goes on where the last has ended: what is before is another site's.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/set4tm/archive/background_job.h"
#include "protocols/set4tm/meter/settings.h"

namespace baudgate::protocols::set4tm {

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

}  // namespace baudgate::protocols::set4tm
