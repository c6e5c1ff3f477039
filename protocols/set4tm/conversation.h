// What a SET-4TM meter is asked and what its replies mean: session, constants, readings.
// Requests go to the line, frames come from it; driven by the poller.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "protocols/protocol.h"
#include "protocols/set4tm/billing_session.h"
#include "protocols/set4tm/clock_drift.h"
#include "protocols/set4tm/identification.h"
#include "protocols/set4tm/journal_session.h"
#include "protocols/set4tm/kept_texts.h"
#include "protocols/set4tm/latch.h"
#include "protocols/set4tm/load_session.h"
#include "protocols/set4tm/meter_memory.h"
#include "protocols/set4tm/plan.h"
#include "protocols/set4tm/settings.h"

namespace baudgate::protocols::set4tm {

class MeterConversation : public Conversation {
 public:
  /// Both outlive the conversation.
  MeterConversation(const config::Device& device, const Settings& settings, MeterBus& bus);

  std::span<const Query> Queries() const override { return plan_.queries(); }
  bool HasEvents() const override { return journals_.has_events(); }
  std::optional<Instant> BackgroundDue() const override;
  void OnEventsKept(std::string_view said) override;
  Result<Request> Ask(const Task& task, Instant now) override;
  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override;
  Then OnSent(const Task& task, const Request& request, Instant now) override;
  void Stamp(Request& request, Now arrives, Duration character) override;
  void OnHostClock(bool right) override { drift_.OnHostClock(right); }
  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant now) override;
  void OnReconnect() override;
  void OnEnabled() override;
  const std::string& Memory() const override { return memory_.text(); }
  void Recall(std::string_view memory, Now now) override;
  const DeviceTrouble& trouble() const override {
    return trouble_ ? trouble_ : identification_.trouble();
  }
  bool ForgetRefusals() override;
  config::Timing LeastTimes(Duration character) const override;
  std::string WhatIsLearned() const override;
  Outcome Check(View request, View frame) const override;
  Answer Interpret(View request, View frame) override;

 private:
  /// A reply after the checks that need no session.
  struct Reply {
    Answer answer;
    View pdu;                            ///< of the request; empty when nothing fits
    std::optional<std::uint8_t> status;  ///< a one-byte reply
    View data;                           ///< any other
  };

  Reply Decode(View request, View frame) const;
  bool Accepts(View asked, View answering) const;
  void ReadStatus(Reply& reply) const;
  void ReadData(Reply& reply) const;

  Request Make(View pdu) const;
  /// The request of a write.
  Result<Bytes> CorrectionOf(const Task& task, Instant now) const;
  void AddDrift(Reply& reply, std::size_t bytes, Instant now);
  bool LatchIsDue(const Task& task, Instant now) const;
  Request MakeLatch() const;
  /// The time of its latch is asked before what the task asks.
  bool AsksLatchTime(const Task& task, Instant now) const;
  /// What the reply says of the latch, and that of what it brings.
  void TakeLatched(Reply& reply);
  void DropLatched(Answer& answer) const;
  void UseMasks(bool masked);
  /// As the type of the meter says. True: the queries are others now.
  bool ChooseIntegers();
  /// The masked read to try in place of the query, once.
  std::optional<Bytes> Trial(std::size_t query) const;
  bool MasksMayHelp() const;
  Answer AfterTrial(Answer answer);
  Answer OtherType();
  /// The step behind a status: reopen, repeat, forget the request, or nothing.
  Answer AfterStatus(const Task& task, Reply reply, Instant now);
  Answer AfterJournal(Reply reply, Instant now);
  Bytes NextInBackground(Instant now);
  Answer AfterBackground(Reply reply, Instant now);
  BackgroundJob& job() const { return *jobs_[job_]; }
  Answer AfterOpen(const Task& task, Reply reply, Instant now);
  Answer AfterClosed(Answer answer);
  bool Verify(std::uint32_t serial);
  Answer Swapped() const;
  Answer AfterNoSerial(Answer answer);
  std::string RefusedText() const;
  Answer PasswordRefused(Answer answer, Instant now);
  Answer End(Answer answer);

  const config::Device& device_;
  const Settings settings_;
  PointFields fields_;
  Identification identification_;
  PduPlan plan_;
  ClockDrift drift_;
  LineLatch& line_latch_;
  MeterLatch latch_;
  JournalSession journals_;
  LoadSession loads_;
  BillingSession billing_;
  const std::array<BackgroundJob*, 2> jobs_ = {&loads_, &billing_};
  KeptTexts kept_;
  Bytes address_;

  // The session: gone with OnReconnect.
  bool masked_ = false;       ///< floats are read by 08 23
  bool integers_ = false;     ///< integers are read in place of floats
  bool tries_masks_ = false;  ///< whether it knows that is not known yet
  bool open_ = false;
  bool verified_ = false;
  bool accepted_ = false;  ///< the password
  Instant last_good_{};
  std::uint8_t mask_id_ = 0;

  // Kept over OnReconnect.
  MeterMemory memory_;
  DeviceTrouble trouble_;

  // The task in the background that came last.
  std::size_t job_ = 0;
  Bytes asked_in_background_;

  // The task under way.
  int reopened_ = 0;
  int repeated_ = 0;
};

}  // namespace baudgate::protocols::set4tm
