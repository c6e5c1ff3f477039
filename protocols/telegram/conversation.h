// What a described device is asked, and what its answers mean for the points.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "config/model/device.h"
#include "protocols/common/probe_choice.h"
#include "protocols/common/query_plan.h"
#include "protocols/conversation.h"
#include "protocols/telegram/answer_reader.h"
#include "protocols/telegram/identification.h"
#include "protocols/telegram/listening.h"
#include "protocols/telegram/plan.h"

namespace baudgate::protocols::telegram {

class TelegramConversation final : public Conversation {
 public:
  TelegramConversation(const config::Device& device, const Settings& settings);

  std::span<const Query> Queries() const override { return plan_.queries(); }
  Result<Request> Ask(const Task& task, Instant now) override;
  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override;
  Then OnSent(const Task& task, const Request& request, Instant now) override;
  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant now) override;
  std::optional<Request> Instead(const Request& request, Outcome outcome, Instant now) override;
  Outcome Check(View request, View frame) const override { return reader_.Check(request, frame); }
  Answer Interpret(View request, View frame) override { return reader_.Interpret(request, frame); }

  const Standing* Listens() const override { return standing_ ? &*standing_ : nullptr; }
  Answer OnUnasked(View message, Now) override {
    listening_.OnMessage(message);
    return reader_.ReadUnasked(message, bound_);
  }
  std::string WhatIsMissing() const override { return listening_.Missing(); }

  void OnReconnect() override;
  const DeviceTrouble& trouble() const override { return identification_.trouble(); }
  bool ForgetRefusals() override { return plan_.ForgetRefusals(); }
  config::Timing LeastTimes(Duration character) const override;

 private:
  const Telegram& TelegramOf(std::size_t number) const {
    return settings_.description->telegrams[number];
  }
  Result<Request> AskProbe();
  Result<Request> AskStep();
  Result<Bytes> BytesOf(std::size_t telegram) const;
  Status Begin(const Task& task, Instant now);
  Answer ReadStep(std::size_t telegram, const Request& request, View frame);
  void NoteTold(const Exchanges::Step& step, const Request& request);
  Answer AfterStep(const Task& task, Answer answer, Instant now);
  Answer GoOnKnown(const Task& task, Answer answer, Instant now);
  void AfterPoll(std::size_t query, Answer& answer, Instant now);

  const config::Device& device_;
  const Settings settings_;  // its description is never null
  const Bound bound_;        // for every telegram
  const AnswerReader reader_;
  Listening listening_;
  QueryPlan<Call> plan_;
  const std::optional<Standing> standing_;
  Identification identification_;
  const std::optional<std::size_t> own_probe_;
  ProbeChoice probes_;

  // The exchange under way.
  Exchanges exchanges_;
  Bound filled_;                  // for its telegrams
  Bytes context_;                 // see Request
  Bound told_;                    // the fields of the telegrams that went before
  Quality said_ = Quality::good;  // what their answers say of the device
  bool repeated_ = false;         // as a whole
  bool goes_on_ = false;          // it has said ask_again
  bool identifies_ = false;       // it asks who the device is, before what was meant
  bool own_ = false;              // a probe that is no poll
};

}  // namespace baudgate::protocols::telegram
