// What a meter keeps itself: journals, which are events, and load profiles and billing readings,
// which are read in the background. Joins the three jobs, and what is kept of each in one text
// (KeptTexts).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "protocols/conversation.h"
#include "protocols/set4tm/archive/billing_session.h"
#include "protocols/set4tm/archive/journals.h"
#include "protocols/set4tm/archive/load_session.h"
#include "protocols/set4tm/meter/identification.h"
#include "protocols/set4tm/meter/settings.h"

namespace baudgate::protocols::set4tm {

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
