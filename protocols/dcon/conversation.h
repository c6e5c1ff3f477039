// DconConversation plans the requests of one DCON module and turns the replies into readings. One
// request serves all points that its command reads. The module is identified before it is polled
// (Identification). Requests, ReplyReader and WriteJob handle single exchanges; Sampling and
// DconBus handle broadcasts to all modules of a line.
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

// Requests builds the request frames of one module: its commands, broadcasts, and the questions of
// its identification, which are sent with and without a checksum.

class Requests {
 public:
  Requests(std::uint8_t address, const Settings& settings);

  Request Own(std::string_view command) const;
  Request Broadcast(std::string_view text) const;
  Request Question(const Identification::Question& question) const;
  /// True if the request is `$AAM` or `$AA2` with the opposite of the configured checksum mode.
  bool IsInOtherMode(View request) const;
  const Settings& SettingsFor(View request) const {
    return IsInOtherMode(request) ? other_mode_ : settings_;
  }

 private:
  const std::uint8_t address_;
  const Settings& settings_;
  Settings other_mode_;  ///< `settings_` with the opposite value of `checksum`
};

// ReplyReader turns the replies of one module into readings of its points. It has no state.
//
//   > #01   < >+05.880+01.230     point "#[0]" is 5.88, point "#[1]" is 1.23

struct Exchanged {
  Command command;
  DecodedReply reply;
};

class ReplyReader {
 public:
  /// `counts`: the device has points that are totals of counters. The references must outlive this
  /// object.
  ReplyReader(const Settings& settings, const Requests& requests, const Places& places,
              const Identification& identification, bool counts)
      : settings_(settings),
        requests_(requests),
        places_(places),
        identification_(identification),
        counts_(counts) {}

  /// Decodes `frame`. Returns nothing if `request` is not a DCON request.
  std::optional<Exchanged> Read(View request, View frame) const;
  Answer ReadingsOf(const Exchanged& exchanged) const;
  Answer Interpret(View request, View frame, bool polled) const;

 private:
  /// True if `frame` has a checksum although `request` was sent without one and the option checksum
  /// is true. The frame is then a late reply to an earlier request with a checksum.
  bool IsOfOwnMode(View request, View frame) const;
  std::optional<Form> PlannedForm(std::string_view command) const;
  void AddLabels(const Exchanged& exchanged, Answer& answer) const;

  const Settings& settings_;
  const Requests& requests_;
  const Places& places_;
  const Identification& identification_;
  const bool counts_;
};

// WriteJob builds the commands that write points of one module, and judges the replies. If a write
// changes several outputs of a group (OutputGroup), one command sets all outputs of the
// group, so their states are read directly before:
//
//   relay_1 on, relay_3 off:   Next  $6       Take  !000900     before: relays 3 and 0 are on
//                              Next  #0003    Take  >           after: relays 1 and 0 are on
class WriteJob {
 public:
  WriteJob(const config::Device& device, const Places& places);

  std::size_t Together(std::span<const PointValue> writes) const;

  struct Step {
    std::string command;
    /// True: the command only reads the states of the outputs; nothing is written yet.
    bool prepares = false;
  };
  Result<Step> Next(const Task& task, Instant now);
  /// Takes the reply to the command that Next returned. `answer`: the readings of that reply.
  Answer Take(const Task& task, const Exchanged& exchanged, Answer answer, Instant now);
  void OnFailure(const Task& task, bool prepares, bool silent);

  /// Call it with each digital word (states of inputs and outputs) that a poll, or the read before
  /// a write, has returned.
  void OnWord(const std::string& command, std::uint64_t word) { words_[command] = word; }
  /// Call it if another request is sent between the read of the output states and the write, so
  /// that the states are read again.
  void OnOther() { certain_.reset(); }
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
  std::map<std::string, std::uint64_t> words_;
  std::optional<Certain> certain_;
  /// True: the module does not accept the command for several outputs, so outputs are written one
  /// by one.
  bool alone_ = false;
};

// Broadcasts that no module answers: `~**` (the host is alive) and `#**` (take a sample now).
// DconBus and Sampling decide when each is due. Conversations send them before their requests.
// Source: dcon reference, 12 and 14.
//
//   > #**                        every module samples
//   > $014   < >011+05.880       1: fetched for the first time, so it is the sample of this #**
//   > $024   < !12A1500
//   > #**                        sent before module 01 is asked again
//
// A module that missed the last `#**` still holds its older sample. If that sample was never
// fetched, the digit is 1, too. So a sample is accepted only if the module's older sample was
// certainly fetched.

inline constexpr const char* kHostIsThere = "~**";
inline constexpr const char* kTakeSample = "#**";
inline constexpr const char* kAskSample = "$4";

/// State that the modules of a line share: a group of modules with a checksum, and a group without.
/// The groups are separate, because a module ignores broadcasts in the other checksum mode.
class DconBus : public Bus {
 public:
  struct Group {
    std::optional<Instant> told_at;  ///< when `~**` (the host is alive) was last sent
    std::uint64_t samples = 0;
    std::optional<Instant> sampled_at;
  };
  Group& Of(bool checksum) { return groups_[checksum ? 1 : 0]; }

 private:
  std::array<Group, 2> groups_;
};

class Sampling {
 public:
  /// `group` must outlive this object. `period`: how often the module is polled; an older sample is
  /// not fetched.
  Sampling(DconBus::Group& group, Duration period) : group_(group), period_(period) {}

  /// True if `#**` must be sent before `$AA4` (fetch the sample): the module was already asked for
  /// the latest sample, or that sample is older than `period`.
  bool WantsNew(Instant now) const;
  void OnSampled(Instant now);
  /// Call it after each `$AA4` (fetch the sample), answered or failed.
  void OnAsked() { asked_ = group_.samples; }
  /// Call it after a reply to `$AA4` (fetch the sample). `first`: the sample was fetched for the
  /// first time. Returns why the sample must be rejected, or nothing if it is valid.
  std::optional<std::string> WhyNot(bool first);
  void OnReconnect() { fetched_.reset(); }

  /// True if before each of the last three replies `#**` was sent more than once.
  bool IsOvertaken() const { return overtaken_ >= kOftenOvertaken; }

 private:
  static constexpr int kOftenOvertaken = 3;

  DconBus::Group& group_;
  Duration period_;
  std::uint64_t asked_ = 0;
  /// The value of DconBus::Group::samples that belongs to the latest reply; empty: no reply came
  /// yet.
  std::optional<std::uint64_t> fetched_;
  /// Number of replies in a row before which `#**` was sent more than once.
  int overtaken_ = 0;
};

class DconConversation : public Conversation {
 public:
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
  /// Returns the command of the task itself, which is sent after the questions of the
  /// identification.
  std::string CommandOf(const Task& task) const;
  bool IsHostDue(Instant now) const;
  Request AskProbe();
  Request AskRead(const std::string& command, Instant now);
  Request AskQuestion(const Identification::Question& question);
  Answer TakeQuestion(const Task& task, const Exchanged& exchanged, Instant now);
  Answer TakeWritten(const Task& task, const Exchanged& exchanged, Instant now);
  Answer TakeRead(const Task& task, const Exchanged& exchanged, Instant now);
  void TakeSample(const Exchanged& exchanged, Answer& answer);
  void LearnPlan(const Exchanged& exchanged, Answer& answer, Instant now);
  void LearnModule(const Task& task, const Exchanged& exchanged, const Answer& answer);
  void Learn(const Identification::Question& question, const DecodedReply& reply);
  Then OnQuestionFailed(const Task& task, const Identification::Question& question, Outcome outcome,
                        bool behind_read);

  const config::Device& device_;
  /// The options, but `enabled` is the channel mask of the module as soon as the module has
  /// reported it.
  Settings settings_;
  const std::uint32_t enabled_;
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
  /// True: the next write must not be sent, because the checksum mode of the module is unknown.
  bool withheld_ = false;
  int counted_again_ = 0;
};

}  // namespace baudgate::protocols::dcon
