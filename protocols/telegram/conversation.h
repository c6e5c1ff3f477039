// `TelegramConversation` polls and writes a device that a description describes. `Exchanges` gives
// the telegrams of a task one after the other, `AnswerReader` reads the answers, and `Listening`
// records which unasked telegrams have come.
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

class AnswerReader {
 public:
  /// For each point: the field of an answer that it reads. Empty: the point is not read.
  using Places = std::vector<std::optional<ReadPlace>>;

  /// `bound`: values of the fields that all telegrams share, such as the address. `description`
  /// must outlive this object.
  AnswerReader(const Description& description, const Bound& bound, const config::Device& device);

  const Places& places() const { return places_; }

  /// Reads the answer to the telegram with this index. `known`: field values that the answer must
  /// repeat. `sent`: the fields of this telegram and of the telegrams before it; they decide which
  /// points get the values, see Questions.
  Answer Read(std::size_t telegram, const Bound& known, const Bound& sent, View frame) const;
  /// Check and Interpret implement the functions of Conversation with these names. Interpret also
  /// returns the fields that no point reads. It does not know the telegrams that were sent before
  /// `request`. So it leaves out points for which such a telegram matters. Example: "READ" after
  /// "CH2".
  Outcome Check(View request, View frame) const;
  Answer Interpret(View request, View frame) const;
  /// Reads a message that the device has sent unasked. `bound`: values that all telegrams share,
  /// such as the address.
  Answer ReadUnasked(View message, const Bound& bound) const;

 private:
  void AddReadings(std::size_t telegram, const Bound& sent, const Reply& reply,
                   Answer& answer) const;

  const Description& description_;
  const Places places_;
  const Questions questions_;  // index: point
};

// Records which unasked telegrams have come, and reports telegrams that points read but that never
// came. It stores the beginnings of at most three messages that no point reads.
class Listening {
 public:
  /// `description` and `bound` must outlive this object.
  Listening(const Description& description, const Bound& bound, const AnswerReader::Places& places);

  void OnMessage(View message);
  /// Returns a text such as "no MDA comes: …". Empty: all telegrams that points read have come.
  std::string Missing() const;

 private:
  struct Awaited {
    std::size_t telegram = 0;
    bool came = false;
    std::string said;  ///< set if the telegram came with another parameter: "speed_unit: M"
  };

  bool Take(Awaited& awaited, View message) const;

  const Description& description_;
  const Bound& bound_;
  std::vector<Awaited> awaited_;     // the unasked telegrams that points read
  std::vector<std::string> others_;  // beginnings of messages that no point reads
};

// The telegrams of one task, which are sent one after the other: telegrams that go before, the main
// telegram (`meant`), and telegrams that go behind.
class Exchanges {
 public:
  explicit Exchanges(const Description& description) : description_(description) {}

  struct Step {
    enum class Part : std::uint8_t { before, meant, behind } part = Part::meant;
    std::size_t telegram = 0;
  };

  void Begin(std::size_t telegram);
  /// Starts the exchange again with its first telegram; telegrams with `once` are sent again as
  /// well.
  void BeginAgain();
  bool under_way() const { return at_ < steps_.size(); }
  const Step& step() const { return steps_[at_]; }
  bool is_first() const { return at_ == 0; }
  std::size_t size() const { return steps_.size(); }

  /// Call it when the step has succeeded. Returns true if another step follows.
  bool Advance();
  /// Call it when the step has failed. Returns true if closing telegrams must still be sent.
  bool Fail();
  /// Forgets which telegrams with `once` were sent, so that they are sent again.
  void Forget() { done_once_.clear(); }
  void Break() { at_ = steps_.size(); }

  /// Sets the outcome of the exchange: the outcome of the main telegram, or the first failure.
  /// Later calls have no effect, because they come with the answers to closing telegrams.
  void EndAs(Outcome outcome, const std::string& reason) {
    if (outcome_ != Outcome::none) return;
    outcome_ = outcome;
    reason_ = reason;
  }
  /// Returns the outcome that EndAs has set; Outcome::none: EndAs was not called yet.
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
  const Settings settings_;  // settings of the device; `description` is never null
  const Bound bound_;        // values of the fields that all telegrams share, such as the address
  const AnswerReader reader_;
  Listening listening_;
  QueryPlan<Call> plan_;
  const std::optional<Standing> standing_;
  Identification identification_;
  const std::optional<std::size_t> own_probe_;
  ProbeChoice probes_;

  Exchanges exchanges_;
  Bound filled_;   // field values for the telegrams of the present exchange
  Bytes context_;  // see Request::context
  Bound told_;     // the fields of the telegrams that were sent before the present step
  // Quality of the device's values according to the answers to the telegrams of the part `before`.
  Quality said_ = Quality::good;
  bool repeated_ = false;  // true: the whole exchange was repeated once
  bool goes_on_ = false;   // true: ask_again was returned, so the next Ask continues the exchange
  // True: the present exchange asks for the name of the device; the main exchange follows.
  bool identifies_ = false;
  bool own_ = false;  // true: the exchange is a probe with a telegram that no poll sends
};

}  // namespace baudgate::protocols::telegram
