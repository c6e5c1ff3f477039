// What a DCON device is asked and what its answers mean: one request per command, however many
// points it serves. Points come from the configuration, readings go to gateway/poll/poller.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

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

  std::span<const Query> Queries() const override { return queries_; }
  Result<Request> Ask(const Task& task, Instant now) override;
  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override;
  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant now) override;
  void OnReconnect() override;
  Answer Interpret(View request, View frame) override;

 private:
  /// What the session knows of one query; same index as in queries_.
  struct Plan {
    std::string command;
    Form form = Form::number;
    config::Group group = config::Group::fast;  ///< as configured
    bool answered = false;                      ///< since the last reconnect
    bool proven = false;                        ///< it has answered ever: good for a probe
    int silences = 0;                           ///< in a row, while it has never answered
  };
  /// A write that the module has confirmed and that is now read back.
  struct ReadBack {
    std::size_t point = kNoPoint;
    Value value;
  };

  void AddPoint(std::size_t index);
  Request MakeRequest(std::string_view command) const;
  Result<Request> AskWrite(const Task& task);
  std::string MakeOwnProbe() const;
  std::string BestProbe() const;
  std::string ProbeCommand() const;
  std::size_t ExpectedChannels(std::string_view command) const;
  std::optional<Form> PlannedForm(std::string_view command) const;
  Answer Read(const Command& command, const Decoded& decoded) const;
  Answer Settle(const Task& task, const Command& command, Answer answer);
  Then Learn(std::string_view command, bool answered);
  Then Demote(std::size_t query);

  const config::Device& device_;
  Settings settings_;
  Result<std::uint8_t> address_;
  std::vector<std::optional<ReadAddress>> reads_;  ///< by point
  std::vector<Query> queries_;
  std::vector<Plan> plans_;
  std::optional<ReadBack> read_back_;
  std::size_t failed_probes_ = 0;
  std::string own_probe_;     ///< answered as no poll is; empty: there is none
  bool probe_known_ = false;  ///< the module has answered it once
  int silent_probes_ = 0;     ///< how often it was asked in vain
};

class DconBus : public Bus {
 public:
  std::unique_ptr<Conversation> MakeConversation(const config::Device& device) override;
};

}  // namespace baudgate::protocols::dcon
