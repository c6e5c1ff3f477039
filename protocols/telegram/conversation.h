// What a described device is asked, and what its answers mean for the points. Exchanges gives the
// telegrams of a task, one after the other, and AnswerReader reads the answers.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "config/model/device.h"
#include "gateway/base/outcome.h"
#include "protocols/common/identification.h"
#include "protocols/common/query_plan.h"
#include "protocols/conversation.h"
#include "protocols/telegram/description.h"
#include "protocols/telegram/identification.h"
#include "protocols/telegram/points.h"

namespace baudgate::protocols::telegram {

// Reads the answers of a described device: their outcome, and the values of its points. Remembers
// nothing. Listening notes which telegrams a device has sent by itself.

class AnswerReader {
 public:
  /// Where each point stands in answers; empty: it is not read.
  using Places = std::vector<std::optional<ReadPlace>>;

  /// `bound`: what every telegram of the device is filled with. `description` outlives it.
  AnswerReader(const Description& description, const Bound& bound, const config::Device& device);

  const Places& places() const { return places_; }

  /// `known`: what the answer has to repeat. `sent`: see Questions.
  Answer Read(std::size_t telegram, const Bound& known, const Bound& sent, View frame) const;
  /// See Conversation. Interpret also returns the fields that no point reads. It knows only
  /// `request`, not the telegrams sent before it, so it leaves out points whose question depends on
  /// such a telegram: "READ" after "CH2".
  Outcome Check(View request, View frame) const;
  Answer Interpret(View request, View frame) const;
  /// `bound`: what every telegram of the device is filled with.
  Answer ReadUnasked(View message, const Bound& bound) const;

 private:
  void AddReadings(std::size_t telegram, const Bound& sent, const Reply& reply,
                   Answer& answer) const;

  const Description& description_;
  const Places places_;
  const Questions questions_;  // by point
};

// Which of the telegrams that a device sends by itself have come: what is said of those that points
// read and that never came. Bounded memory.
class Listening {
 public:
  /// `description` and `bound` outlive it.
  Listening(const Description& description, const Bound& bound, const AnswerReader::Places& places);

  /// A whole message of the description.
  void OnMessage(View message);
  /// "no MDA comes: …"; empty: all have come that points read.
  std::string Missing() const;

 private:
  struct Awaited {
    std::size_t telegram = 0;
    bool came = false;
    std::string said;  ///< it came with another parameter: "speed_unit: M"
  };

  bool Take(Awaited& awaited, View message) const;

  const Description& description_;
  const Bound& bound_;
  std::vector<Awaited> awaited_;     // those that points read
  std::vector<std::string> others_;  // how other messages begin
};

// Which telegrams are sent for a task, one after the other: those that go before, the one that is
// meant, those that go behind.
class Exchanges {
 public:
  /// `description` outlives it.
  explicit Exchanges(const Description& description) : description_(description) {}

  struct Step {
    enum class Part : std::uint8_t { before, meant, behind } part = Part::meant;
    std::size_t telegram = 0;
  };

  void Begin(std::size_t telegram);
  /// Once more from its first telegram on, those that are sent only once as well.
  void BeginAgain();
  bool under_way() const { return at_ < steps_.size(); }
  const Step& step() const { return steps_[at_]; }
  bool is_first() const { return at_ == 0; }
  std::size_t size() const { return steps_.size(); }

  /// The step has succeeded. True: another one follows.
  bool Advance();
  /// It has failed. True: what closes the exchange is still to be sent.
  bool Fail();
  /// What is sent only once is sent again.
  void Forget() { done_once_.clear(); }
  void Break() { at_ = steps_.size(); }

  /// How the telegram that is meant, or the first failure, has ended. The first call counts: the
  /// answer to a closing telegram says nothing of what was meant.
  void EndAs(Outcome outcome, const std::string& reason) {
    if (outcome_ != Outcome::none) return;
    outcome_ = outcome;
    reason_ = reason;
  }
  /// Outcome::none: neither has come yet.
  Outcome outcome() const { return outcome_; }
  const std::string& reason() const { return reason_; }

 private:
  const Description& description_;
  std::vector<Step> steps_;
  std::size_t at_ = 0;
  std::size_t meant_ = 0;
  std::set<std::size_t> done_once_;
  Outcome outcome_ = Outcome::none;
  std::string reason_;
};

class TelegramConversation final : public Conversation {
 public:
  TelegramConversation(const config::Device& device, const Settings& settings);

  std::span<const Query> Queries() const override { return plan_.queries(); }
  Result<Request> Ask(const Task& task, Instant now) override;
  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override;
  Then OnSent(const Task& task, const Request& request, Instant now) override;
  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant now) override;
  std::optional<Request> Instead(const Request& request, Outcome outcome, Instant now) override;
  Outcome Check(View request, View frame) const override { return reader_.Check(request, frame); }
  Answer Interpret(View request, View frame) override { return reader_.Interpret(request, frame); }

  const Standing* Listens() const override { return standing_ ? &*standing_ : nullptr; }
  Answer OnUnasked(View message, Now) override {
    listening_.OnMessage(message);
    return reader_.ReadUnasked(message, bound_);
  }
  std::string WhatIsMissing() const override { return listening_.Missing(); }

  void OnReconnect() override;
  const DeviceTrouble& trouble() const override { return identification_.trouble(); }
  bool ForgetRefusals() override { return plan_.ForgetRefusals(); }
  config::Timing LeastTimes(Duration character) const override;

 private:
  const Telegram& TelegramOf(std::size_t number) const {
    return settings_.description->telegrams[number];
  }
  Result<Request> AskProbe();
  Result<Request> AskStep();
  Result<Bytes> BytesOf(std::size_t telegram) const;
  Status Begin(const Task& task, Instant now);
  Answer ReadStep(std::size_t telegram, const Request& request, View frame);
  void NoteTold(const Exchanges::Step& step, const Request& request);
  Answer AfterStep(const Task& task, Answer answer, Instant now);
  Answer GoOnKnown(const Task& task, Answer answer, Instant now);
  void AfterPoll(std::size_t query, Answer& answer, Instant now);

  const config::Device& device_;
  const Settings settings_;  // its description is never null
  const Bound bound_;        // for every telegram
  const AnswerReader reader_;
  Listening listening_;
  QueryPlan<Call> plan_;
  const std::optional<Standing> standing_;
  Identification identification_;
  const std::optional<std::size_t> own_probe_;
  ProbeChoice probes_;

  // The exchange under way.
  Exchanges exchanges_;
  Bound filled_;                  // for its telegrams
  Bytes context_;                 // see Request
  Bound told_;                    // the fields of the telegrams that went before
  Quality said_ = Quality::good;  // what their answers say of the device
  bool repeated_ = false;         // as a whole
  bool goes_on_ = false;          // it has said ask_again
  bool identifies_ = false;       // it asks who the device is, before what was meant
  bool own_ = false;              // a probe that is no poll
};

}  // namespace baudgate::protocols::telegram
