// What a DCON device is asked and what its answers mean: one request per command, however many
// points it serves. Which module answers is found out before it is polled (identification.h).
// Requests, ReplyReader and WriteJob are the single exchanges of one module; Sampling and DconBus
// handle what goes to all modules of a line.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "gateway/base/time.h"
#include "protocols/common/query_plan.h"
#include "protocols/conversation.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/decode.h"
#include "protocols/dcon/identification.h"
#include "protocols/dcon/places.h"
#include "protocols/dcon/settings.h"
#include "protocols/dcon/totals.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::dcon {

// The requests of one module as frames: its own commands, broadcasts, and the questions of its
// identification, which go out in either checksum mode. ReplyReader reads the replies, and WriteJob
// writes points.

class Requests {
 public:
  /// `settings` outlive it.
  Requests(std::uint8_t address, const Settings& settings);

  Request Own(std::string_view command) const;
  Request Broadcast(std::string_view text) const;
  Request Question(const Identification::Question& question) const;
  /// Whether the request is a question in the other checksum mode.
  bool IsInOtherMode(View request) const;
  /// The settings with which the reply to the request is read.
  const Settings& SettingsFor(View request) const {
    return IsInOtherMode(request) ? other_mode_ : settings_;
  }

 private:
  const std::uint8_t address_;
  const Settings& settings_;
  Settings other_mode_;  ///< the same with the checksum the other way
};

// What replies of one module mean for its points. It remembers nothing.
//
//   > #01   < >+05.880+01.230     point "#[0]" is 5.88, point "#[1]" is 1.23

/// A request and its reply, decoded.
struct Exchanged {
  Command command;
  DecodedReply reply;
};

class ReplyReader {
 public:
  /// `counts`: totals are kept of counters. All others outlive it.
  ReplyReader(const Settings& settings, const Requests& requests, const Places& places,
              const Identification& identification, bool counts)
      : settings_(settings),
        requests_(requests),
        places_(places),
        identification_(identification),
        counts_(counts) {}

  /// Empty: the request is none.
  std::optional<Exchanged> Read(View request, View frame) const;
  /// A reading of each point that the command reads.
  Answer ReadingsOf(const Exchanged& exchanged) const;
  /// See Conversation::Interpret. `polled`: the device has points.
  Answer Interpret(View request, View frame, bool polled) const;

 private:
  /// The frame ends with a right checksum, but this request went out without one: it is a late
  /// reply to an earlier request in the configured mode.
  bool IsOfOwnMode(View request, View frame) const;
  std::optional<Form> PlannedForm(std::string_view command) const;
  void AddLabels(const Exchanged& exchanged, Answer& answer) const;

  const Settings& settings_;
  const Requests& requests_;
  const Places& places_;
  const Identification& identification_;
  const bool counts_;
};

// Writes to the points of one module: the command, and what its reply means. Several outputs of a
// group go out in one command, which sets the whole group (places.h), so what the other
// outputs are is read just before:
//
//   on relay_1, off relay_3:   Next  $6       Take  !000900     relays 3 and 0 are on
//                              Next  #0003    Take  >           done
//
class WriteJob {
 public:
  /// Both outlive it.
  WriteJob(const config::Device& device, const Places& places);

  /// How many of these writes, from the first on, go together.
  std::size_t Together(std::span<const PointValue> writes) const;

  struct Step {
    std::string command;
    bool prepares = false;  ///< it reads what the others are
  };
  Result<Step> Next(const Task& task, Instant now);
  /// `answer`: the readings of the reply to the command of Next.
  Answer Take(const Task& task, const Exchanged& exchanged, Answer answer, Instant now);
  /// The command of Next was not answered. `prepares`: as in Step.
  void OnFailure(const Task& task, bool prepares, bool silent);

  /// A poll or a read for a write has brought a digital word.
  void OnWord(const std::string& command, std::uint64_t word) { words_[command] = word; }
  /// Something else was asked in between.
  void OnOther() { certain_.reset(); }
  /// Another module may answer now.
  void OnReconnect();

 private:
  struct Certain {
    std::uint64_t word = 0;
    Instant at{};
  };

  Step NextOfGroup(const Task& task, Instant now);
  Answer TakeOutputs(const Task& task, const Exchanged& exchanged, Answer answer, Instant now);

  const config::Device& device_;
  const Places& places_;
  std::map<std::string, std::uint64_t> words_;  ///< by command, as they were read last
  std::optional<Certain> certain_;  ///< what outputs are, for the write of several under way
  bool alone_ = false;              ///< the module does not take several outputs at once
};

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
