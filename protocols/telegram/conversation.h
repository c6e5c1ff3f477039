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
#include "protocols/telegram/plan.h"
#include "protocols/telegram/points.h"

namespace baudgate::protocols::telegram {

class TelegramConversation final : public Conversation {
 public:
  TelegramConversation(const config::Device& device, const Settings& settings);

  std::span<const Query> Queries() const override { return plan_.queries(); }
  Result<Request> Ask(const Task& task, Instant now) override;
  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override;
  Then OnSent(const Task& task, const Request& request, Instant now) override;
  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant now) override;
  Outcome Check(View request, View frame) const override;
  Answer Interpret(View request, View frame) override;

  const Standing* Listens() const override { return standing_ ? &*standing_ : nullptr; }
  Answer OnUnasked(View message, Now received) override;

  void OnReconnect() override;
  const DeviceTrouble& trouble() const override { return trouble_; }
  bool ForgetRefusals() override { return plan_.ForgetRefusals(); }
  config::Timing LeastTimes(Duration character) const override;

 private:
  const Telegram& TelegramOf(std::size_t number) const {
    return settings_.description->telegrams[number];
  }
  Result<Request> AskProbe();
  Result<Request> AskStep();
  Result<Bytes> BytesOf(std::size_t telegram) const;
  Status Begin(const Task& task);
  Answer AfterStep(const Task& task, Answer answer);
  Answer AfterIdentity(const Reply& reply);
  Answer GoOnKnown(const Task& task, Answer answer);
  void AfterPoll(std::size_t query, Answer& answer);
  Answer AnswerOf(std::size_t telegram, const Bound& sent, View frame) const;
  void AddReadings(std::size_t telegram, const Bound& sent, const Reply& reply,
                   Answer& answer) const;

  const config::Device& device_;
  const Settings settings_;                            // its description is never null
  const Bound bound_;                                  // for every telegram
  const std::vector<std::optional<ReadPlace>> reads_;  // by point
  QueryPlan<Call> plan_;
  const std::optional<Standing> standing_;
  const std::optional<std::size_t> identity_;  // the telegram that tells the device's name
  const std::optional<std::size_t> own_probe_;
  ProbeChoice probes_;

  // The exchange under way.
  Exchanges exchanges_;
  Bound filled_;                     // for its telegrams
  bool goes_on_ = false;             // it has said ask_again
  bool identifies_ = false;          // it asks who the device is, before what was meant
  bool own_ = false;                 // a probe that is no poll
  Outcome outcome_ = Outcome::none;  // of the telegram that is meant
  std::string reason_;

  bool identified_ = false;  // it was asked who it is, and has said so or was silent
  DeviceTrouble trouble_;
};

}  // namespace baudgate::protocols::telegram
