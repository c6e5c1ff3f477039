// The conversation with a SET-4TM meter: what is asked (requests.h), what a reply says (reply.h)
// and what follows from it (replies.h), joined.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/protocol.h"
#include "protocols/set4tm/meter_parts.h"
#include "protocols/set4tm/replies.h"
#include "protocols/set4tm/reply.h"
#include "protocols/set4tm/requests.h"

namespace baudgate::protocols::set4tm {

class MeterConversation : public Conversation {
 public:
  /// `device` and `bus` outlive the conversation.
  MeterConversation(const config::Device& device, const Settings& settings, MeterBus& bus);

  std::span<const Query> Queries() const override { return parts_.reads.Queries(); }
  bool HasEvents() const override { return parts_.archive.has_events(); }
  std::optional<Instant> BackgroundDue() const override;
  void OnEventsKept(std::string_view said) override { parts_.archive.OnKept(said); }
  Result<Request> Ask(const Task& task, Instant now) override { return requests_.Next(task, now); }
  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override;
  Then OnSent(const Task& task, const Request& request, Instant now) override;
  void Stamp(Request& request, Now arrives, Duration character) override;
  void OnHostClock(bool right) override { parts_.drift.OnHostClock(right); }
  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant now) override;
  void OnReconnect() override;
  void OnEnabled() override { parts_.session.OnEnabled(); }
  const std::string& Memory() const override { return parts_.session.memory(); }
  void Recall(std::string_view memory, Now now) override { parts_.session.Recall(memory, now); }
  const DeviceTrouble& trouble() const override {
    return parts_.session.trouble() ? parts_.session.trouble() : parts_.identification.trouble();
  }
  bool ForgetRefusals() override;
  config::Timing LeastTimes(Duration character) const override;
  std::string WhatIsLearned() const override;
  Outcome Check(View request, View frame) const override { return reader_.Check(request, frame); }
  Answer Interpret(View request, View frame) override;

 private:
  MeterParts parts_;
  ReplyReader reader_;
  MeterRequests requests_;
  MeterReplies replies_;
};

}  // namespace baudgate::protocols::set4tm
