// What a DCON device is asked and what its answers mean: one request per command, however many
// points it serves. Points come from the configuration, readings go to gateway/poll/poller.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/common/probe_choice.h"
#include "protocols/common/query_plan.h"
#include "protocols/conversation.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/decode.h"
#include "protocols/dcon/points.h"
#include "protocols/dcon/settings.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::dcon {

class DconConversation : public Conversation {
 public:
  /// `device` outlives the conversation.
  explicit DconConversation(const config::Device& device);

  std::span<const Query> Queries() const override { return plan_.queries(); }
  Result<Request> Ask(const Task& task, Instant now) override;
  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override;
  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant now) override;
  void OnReconnect() override;
  Outcome Check(View request, View frame) const override;
  Answer Interpret(View request, View frame) override;

 private:
  /// One read command and the form of its reply: `#01` as joined numbers.
  struct Read {
    std::string command;
    Form form = Form::number;
    bool operator==(const Read&) const = default;
  };
  /// A write that the module has confirmed and that is now read back.
  struct ReadBack {
    std::size_t point = kNoPoint;
    Value value;
  };

  void PlanReads();
  Request MakeRequest(std::string_view command) const;
  Result<Request> AskWrite(const Task& task);
  std::string MakeOwnProbe() const;
  std::size_t QueryOf(std::string_view command) const;
  std::string ProbeCommand() const;
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
  Answer AfterRead(const Task& task, const Command& command, Answer answer);
  Answer AfterWrite(const Task& task, Answer answer);

  const config::Device& device_;
  Settings settings_;
  std::uint8_t address_;
  std::vector<std::optional<ReadAddress>> reads_;  ///< by point
  QueryPlan<Read> plan_;
  std::optional<ReadBack> read_back_;
  std::string own_probe_;  ///< answered as no poll is; empty: there is none
  ProbeChoice probes_;
};

}  // namespace baudgate::protocols::dcon
