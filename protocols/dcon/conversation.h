// What a DCON device is asked and what its answers mean: one request per command, however many
// points it serves. Points come from the configuration, readings go to gateway/poll/poller.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/common/query_plan.h"
#include "protocols/conversation.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/decode.h"
#include "protocols/dcon/identification.h"
#include "protocols/dcon/points.h"
#include "protocols/dcon/probing.h"
#include "protocols/dcon/settings.h"
#include "protocols/dcon/totals.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::dcon {

class DconConversation : public Conversation {
 public:
  /// `device` outlives the conversation.
  explicit DconConversation(const config::Device& device);

  std::span<const Query> Queries() const override;
  Result<Request> Ask(const Task& task, Instant now) override;
  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override;
  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant now) override;
  void OnReconnect() override;
  const DeviceTrouble& trouble() const override { return identification_.trouble(); }
  Outcome Check(View request, View frame) const override;
  Answer Interpret(View request, View frame) override;
  const std::string& Memory() const override { return totals_->memory(); }
  void Recall(std::string_view memory, Now) override { totals_->Recall(memory); }

 private:
  /// A write that the module has confirmed and that is now read back.
  struct ReadBack {
    std::size_t point = kNoPoint;
    Value value;
  };

  void PlanReads();
  Request MakeRequest(std::string_view command) const;
  Request MakeQuestion(const Identification::Question& question) const;
  bool IsInOtherMode(View request) const;
  bool IsClear(std::string_view command) const;
  std::string CommandOf(const Task& task) const;
  Request AskProbe();
  Result<Request> AskWrite(const Task& task);
  std::size_t QueryOf(std::string_view command) const;
  std::size_t ExpectedChannels(std::string_view command) const;
  std::optional<Form> PlannedForm(std::string_view command) const;
  /// A request and its reply, decoded; nothing when the request is none.
  struct Exchanged {
    Command command;
    DecodedReply reply;
  };
  std::optional<Exchanged> Decode(View request, View frame) const;
  Answer ReadingsOf(const Exchanged& exchanged) const;
  void AddLabels(const Exchanged& exchanged, Answer& answer) const;
  Answer OnIdentified(const Task& task, const Exchanged& exchanged);
  Answer OnAnswered(const Task& task, const Exchanged& exchanged, Instant now);
  Then AfterQuestion(const Task& task);
  Answer AfterRead(const Task& task, const Exchanged& exchanged, Answer answer);
  void Learn(const Identification::Question& question, const DecodedReply& reply);
  Answer AfterWrite(const Task& task, Answer answer);

  const config::Device& device_;
  Settings settings_;
  Settings other_mode_;  ///< the same with the checksum the other way
  std::uint8_t address_;
  Probing::Reads reads_;
  QueryPlan<Read> plan_;
  std::optional<ReadBack> read_back_;
  Identification identification_;
  std::optional<Identification::Question> question_;  ///< the request under way
  int questions_ = 0;                                 ///< of the task under way
  // Always there once the reads are planned.
  std::optional<Probing> probing_;
  std::optional<Totals> totals_;
  bool counts_twice_ = false;  ///< the request under way is the second one
};

}  // namespace baudgate::protocols::dcon
