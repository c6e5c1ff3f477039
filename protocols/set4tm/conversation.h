// What a SET-4TM meter is asked and what its replies mean. Each request has its kind; a table says
// what follows from the replies to each kind (conversation.cpp).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/protocol.h"
#include "protocols/set4tm/archive.h"
#include "protocols/set4tm/clock_drift.h"
#include "protocols/set4tm/identification.h"
#include "protocols/set4tm/latched_reads.h"
#include "protocols/set4tm/point_reads.h"
#include "protocols/set4tm/reply.h"
#include "protocols/set4tm/session.h"
#include "protocols/set4tm/settings.h"

namespace baudgate::protocols::set4tm {

class MeterConversation : public Conversation {
 public:
  /// `device` and `bus` outlive the conversation.
  MeterConversation(const config::Device& device, const Settings& settings, MeterBus& bus);

  std::span<const Query> Queries() const override { return reads_.Queries(); }
  bool HasEvents() const override { return archive_.has_events(); }
  std::optional<Instant> BackgroundDue() const override;
  void OnEventsKept(std::string_view said) override { archive_.OnKept(said); }
  Result<Request> Ask(const Task& task, Instant now) override;
  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override;
  Then OnSent(const Task& task, const Request& request, Instant now) override;
  void Stamp(Request& request, Now arrives, Duration character) override;
  void OnHostClock(bool right) override { drift_.OnHostClock(right); }
  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant now) override;
  void OnReconnect() override;
  void OnEnabled() override { session_.OnEnabled(); }
  const std::string& Memory() const override { return session_.memory(); }
  void Recall(std::string_view memory, Now now) override { session_.Recall(memory, now); }
  const DeviceTrouble& trouble() const override {
    return session_.trouble() ? session_.trouble() : identification_.trouble();
  }
  bool ForgetRefusals() override;
  config::Timing LeastTimes(Duration character) const override;
  std::string WhatIsLearned() const override;
  Outcome Check(View request, View frame) const override { return reader_.Check(request, frame); }
  Answer Interpret(View request, View frame) override;

 private:
  /// What a request is for.
  enum class Kind : std::uint8_t {
    latch,       ///< the broadcast, which nobody answers
    link,        ///< link test
    open,        ///< open the channel
    serial,      ///< who is it?
    question,    ///< type or ratios, before what they decide
    latch_time,  ///< has it heard the broadcast?
    record,      ///< of a journal
    background,  ///< of a load profile or a billing reading
    trial,       ///< a masked read, to learn whether the meter knows it
    read,        ///< a query of points
    write,       ///< a correction of the clock
  };
  /// A reply under way through the table.
  struct Step {
    const Task& task;
    Reply reply;
    std::size_t bytes = 0;  ///< of the whole frame
    Instant now{};
  };
  struct Row;
  static const Row kRows[];
  static const Row& RowOf(Kind kind);

  /// From now on the latest request is of this kind.
  Request Make(Kind kind, View pdu);
  Result<Bytes> CorrectionOf(const Task& task, Instant now) const;
  /// What the session needs first; nothing: the task's own request may be sent.
  std::optional<Request> AskForSession(const Task& task, Instant now);
  Request AskOwn(const Task& task, Instant now);
  Request AskRead(std::size_t query);
  bool AsksLatchTime(const Task& task, Instant now) const;
  /// The reply answers the poll's own query.
  bool IsOwn(const Step& step) const;

  static Answer Plain(MeterConversation& its, Step& step);
  Answer TakeStatus(Step& step);
  Answer TakeData(Step& step);
  Answer TakePrelude(Step& step);
  Answer TakeRead(Step& step);
  Answer ReadRefused(Step& step);
  void AddDrift(Step& step);

  const config::Device& device_;
  const Settings settings_;
  const Bytes address_;
  Identification identification_;
  PointReads reads_;
  ReplyReader reader_;
  ClockDrift drift_;
  LatchedReads latched_;
  MeterArchive archive_;
  MeterSession session_;
  Kind asked_ = Kind::open;  // the latest request
};

}  // namespace baudgate::protocols::set4tm
