// What a DCON device is asked and what its answers mean: one request per command, however many
// points it serves. Which module answers is found out before it is polled (questions.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "protocols/common/query_plan.h"
#include "protocols/conversation.h"
#include "protocols/dcon/broadcasts.h"
#include "protocols/dcon/identification.h"
#include "protocols/dcon/places.h"
#include "protocols/dcon/probing.h"
#include "protocols/dcon/questions.h"
#include "protocols/dcon/reply_reader.h"
#include "protocols/dcon/requests.h"
#include "protocols/dcon/settings.h"
#include "protocols/dcon/totals.h"
#include "protocols/dcon/write_job.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::dcon {

class DconConversation : public Conversation {
 public:
  /// `device` and `bus` outlive the conversation.
  DconConversation(const config::Device& device, const Settings& settings, DconBus& bus);

  std::span<const Query> Queries() const override;
  Result<Request> Ask(const Task& task, Instant now) override;
  std::size_t WritesTogether(std::span<const PointValue> writes) const override {
    return writes_.Together(writes);
  }
  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override;
  Then OnSent(const Task& task, const Request& request, Instant now) override;
  std::optional<Request> Instead(const Request& request, Outcome outcome, Instant now) override;
  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant now) override;
  void OnReconnect() override;
  const DeviceTrouble& trouble() const override { return identification_.trouble(); }
  Outcome Check(View request, View frame) const override;
  Answer Interpret(View request, View frame) override {
    return reader_.Interpret(request, frame, !device_.points.empty());
  }
  const std::string& Memory() const override { return totals_.memory(); }
  void Recall(std::string_view memory, Now) override { totals_.Recall(memory); }
  std::string WhatIsLearned() const override;

 private:
  /// What the task wants to send once it is known which module answers.
  std::string CommandOf(const Task& task) const;
  bool IsHostDue(Instant now) const;
  Request AskProbe();
  Request AskRead(const std::string& command, Instant now);
  Request AskQuestion(const Identification::Question& question);
  Answer TakeQuestion(const Task& task, const Exchanged& exchanged, Instant now);
  Answer TakeWritten(const Task& task, const Exchanged& exchanged, Instant now);
  Answer TakeRead(const Task& task, const Exchanged& exchanged, Instant now);
  void TakeSample(const Exchanged& exchanged, Answer& answer);
  /// What the reply to a poll or probe says of the plan.
  void LearnPlan(const Exchanged& exchanged, Answer& answer, Instant now);
  /// The same, of the module and its outputs.
  void LearnModule(const Task& task, const Exchanged& exchanged, const Answer& answer);
  void Learn(const Identification::Question& question, const DecodedReply& reply);
  Then OnQuestionFailed(const Task& task, const Identification::Question& question, Outcome outcome,
                        bool behind_read);

  const config::Device& device_;
  Settings settings_;            ///< `enabled` as the module has said
  const std::uint32_t enabled_;  ///< as configured
  DconBus::Group& group_;
  const Places places_;
  QueryPlan<Read> plan_;
  Identification identification_;
  const Requests requests_;
  Questions questions_;
  Probing probing_;
  Totals totals_;
  const ReplyReader reader_;
  WriteJob writes_;
  Sampling sampling_;
  bool withheld_ = false;  ///< a write: the module has not told its mode, and that is said next
  int counted_again_ = 0;  ///< how often in this poll
};

}  // namespace baudgate::protocols::dcon
