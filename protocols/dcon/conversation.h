// What a DCON device is asked and what its answers mean: one request per command, however many
// points it serves. Which module answers is found out before it is polled (identification.h).
// Sampling and DconBus handle what goes to all modules of a line.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "gateway/base/time.h"
#include "protocols/common/query_plan.h"
#include "protocols/conversation.h"
#include "protocols/dcon/exchanges.h"
#include "protocols/dcon/identification.h"
#include "protocols/dcon/places.h"
#include "protocols/dcon/settings.h"
#include "protocols/dcon/totals.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::dcon {

// What goes to all modules of a line at once and is answered by none: `~**`, the host is there, and
// `#**`, take a sample now. When each is due; conversations send them in front of
// their own requests. Source: dcon reference, 12 and 14.
//
//   > #**                        every module samples
//   > $014   < >011+05.880       1: fetched for the first time, so it is the sample of this #**
//   > $024   < !12A1500
//   > #**                        module 01 is asked again
//
// A module that has not heard the last `#**` still holds the sample before; its digit is 0 when
// that was fetched. So a sample counts only when the one before it is known to have been fetched.

inline constexpr const char* kHostIsThere = "~**";
inline constexpr const char* kTakeSample = "#**";
inline constexpr const char* kAskSample = "$4";

/// A module hears what comes in its own checksum mode: two groups share a line at most.
class DconBus : public Bus {
 public:
  struct Group {
    std::optional<Instant> told_at;     ///< `~**` was sent
    std::uint64_t samples = 0;          ///< so many `#**` were
    std::optional<Instant> sampled_at;  ///< the latest of them
  };
  Group& Of(bool checksum) { return groups_[checksum ? 1 : 0]; }

 private:
  std::array<Group, 2> groups_;
};

/// One module's part in the samples of its line.
class Sampling {
 public:
  /// `group` outlives it. `period`: of its polls; an older sample is not fetched.
  Sampling(DconBus::Group& group, Duration period) : group_(group), period_(period) {}

  /// `#**` is to be sent before `$AA4`: it has been asked for the latest sample, or that is old.
  bool WantsNew(Instant now) const;
  void OnSampled(Instant now);
  /// `$AA4` was answered, or has failed.
  void OnAsked() { asked_ = group_.samples; }
  /// It was answered. `first`: what the module says of this fetch. Empty: it is the sample that
  /// was asked for; else why its value does not count.
  std::optional<std::string> WhyNot(bool first);
  /// Another module may answer now.
  void OnReconnect() { fetched_.reset(); }

  /// Samples of others go on between its own polls.
  bool IsOvertaken() const { return overtaken_ >= kOftenOvertaken; }

 private:
  static constexpr int kOftenOvertaken = 3;

  DconBus::Group& group_;
  Duration period_;
  std::uint64_t asked_ = 0;
  std::optional<std::uint64_t> fetched_;  ///< the latest when it answered last
  int overtaken_ = 0;                     ///< in a row
};

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
