// What a DCON device is asked and what its answers mean: one request per command, however many
// points it serves. Points come from the configuration, readings go to gateway/poll/poller.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "protocols/common/query_plan.h"
#include "protocols/conversation.h"
#include "protocols/dcon/broadcasts.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/decode.h"
#include "protocols/dcon/identification.h"
#include "protocols/dcon/output_group.h"
#include "protocols/dcon/points.h"
#include "protocols/dcon/probing.h"
#include "protocols/dcon/settings.h"
#include "protocols/dcon/totals.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::dcon {

class DconConversation : public Conversation {
 public:
  /// Both outlive the conversation.
  DconConversation(const config::Device& device, const Settings& settings, DconBus& bus);

  std::span<const Query> Queries() const override;
  Result<Request> Ask(const Task& task, Instant now) override;
  std::size_t WritesTogether(std::span<const PointValue> writes) const override;
  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override;
  Then OnSent(const Task& task, const Request& request, Instant now) override;
  std::optional<Request> Instead(const Request& request, Outcome outcome, Instant now) override;
  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant now) override;
  void OnReconnect() override;
  const DeviceTrouble& trouble() const override { return identification_.trouble(); }
  Outcome Check(View request, View frame) const override;
  Answer Interpret(View request, View frame) override;
  const std::string& Memory() const override { return totals_->memory(); }
  void Recall(std::string_view memory, Now) override { totals_->Recall(memory); }
  std::string WhatIsLearned() const override;

 private:
  void PlanReads();
  Request MakeRequest(std::string_view command) const;
  Request MakeQuestion(const Identification::Question& question) const;
  bool IsInOtherMode(View request) const;
  bool IsHostDue(Instant now) const;
  bool IsSetting(std::string_view command) const;
  Request MakeBroadcast(std::string_view text) const;
  std::string CommandOf(const Task& task) const;
  Request AskProbe();
  Request AskAnew();
  Result<Request> AskRead(const std::string& command, Instant now);
  Result<Request> AskWrite(const Task& task, Instant now);
  Request AskGroup(const Task& task, Instant now);
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
  Answer OnIdentified(const Task& task, const Exchanged& exchanged, Instant now);
  Answer OnAnswered(const Task& task, const Exchanged& exchanged, Instant now);
  Answer OnWritten(const Task& task, const Exchanged& exchanged, Instant now);
  Answer OnOutputs(const Task& task, const Exchanged& exchanged, Instant now);
  void TakeSample(const Exchanged& exchanged, Answer& answer);
  Then AfterQuestion(const Task& task);
  Then AfterPoll(const std::string& command, Instant now);
  Answer AfterRead(const Task& task, const Exchanged& exchanged, Answer answer);
  void Learn(const Identification::Question& question, const DecodedReply& reply);

  const config::Device& device_;
  Settings settings_;
  Settings other_mode_;  ///< the same with the checksum the other way
  std::uint8_t address_;
  DconBus::Group& group_;
  Probing::Reads reads_;
  std::vector<std::optional<WriteAddress>> writes_;  // by point
  GroupedOutputs outputs_;
  QueryPlan<Read> plan_;
  Identification identification_;
  std::optional<Identification::Question> question_;  ///< the request under way
  std::optional<Identification::Question> anew_;      ///< to be asked behind the read
  int questions_ = 0;                                 ///< of the task under way
  // Always there once the reads are planned.
  std::optional<Probing> probing_;
  std::optional<Totals> totals_;
  int counted_again_ = 0;  // so often in this poll
  Sampling sampling_;
  std::map<std::string, std::uint64_t> words_;  ///< digital ones as they were read last
  struct Certain {
    std::uint64_t word = 0;
    Instant at{};
  };
  std::optional<Certain> certain_;  ///< what outputs are, for the write of several under way
  bool alone_ = false;              ///< the module does not take several outputs at once
};

}  // namespace baudgate::protocols::dcon
