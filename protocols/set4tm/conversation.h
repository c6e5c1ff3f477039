// The conversation with a SET-4TM meter: what is asked, what a reply says
// (protocols/set4tm/meter/point_reads.h) and what follows from it, joined. MeterParts holds the
// parts, MeterRequests decides what is asked, and MeterReplies what follows.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocols/common/query_plan.h"
#include "protocols/protocol.h"
#include "protocols/set4tm/archive/archive.h"
#include "protocols/set4tm/meter/clock.h"
#include "protocols/set4tm/meter/identification.h"
#include "protocols/set4tm/meter/latch.h"
#include "protocols/set4tm/meter/point_reads.h"
#include "protocols/set4tm/meter/settings.h"
#include "protocols/set4tm/session.h"

namespace baudgate::protocols::set4tm {

// What is known of one meter, and the jobs on it: the parts that MeterConversation joins.
// MeterRequests decides what is asked, MeterReplies what follows from replies.
struct MeterParts {
  /// `device` and `bus` outlive it.
  MeterParts(const config::Device& its_device, const Settings& its_settings, MeterBus& bus)
      : device(its_device),
        settings(its_settings),
        identification(device, settings),
        reads(device, settings, identification),
        latched(settings.latch, bus.latch),
        archive(device.events, settings, identification),
        session(settings) {}

  const config::Device& device;
  /// Lets everything that the meter has refused be asked again, except points. `journals`: see
  /// MeterArchive.
  void ForgetRefusals(bool journals) {
    identification.ForgetRefusals();
    archive.ForgetRefusals(journals);
    latched.ForgetRefusals();
    reads.TryMasks();
  }

  const Settings settings;
  TryAgain refused;  ///< requests that read no point: constants, masks, load profiles
  Identification identification;
  PointReads reads;
  ClockDrift drift;
  LatchedReads latched;
  MeterArchive archive;
  MeterSession session;
};

// What a SET-4TM meter is asked next: what a task needs first, and then the task's own request.
// MeterReplies decides what follows from the reply.
//
//   a poll of 08 1B 00 11     > 05 01 30 30 …    the channel is not open yet
//                             > 05 08 00         who is it?
//                             > 05 08 12         its type decides which floats there are
//                             > 05 08 1B 00 11

/// What a request is for.
enum class RequestKind : std::uint8_t {
  latch,       ///< the broadcast, which nobody answers
  link,        ///< link test
  other_mode,  ///< who is it, with the other checksum? The answer is for the status alone
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

class MeterRequests {
 public:
  /// `parts` outlive it.
  explicit MeterRequests(MeterParts& parts);

  /// The error: the task's value cannot be written.
  Result<Request> Next(const Task& task, Instant now);
  /// The kind of the latest request.
  RequestKind kind() const { return kind_; }

 private:
  /// From now on the latest request is of this kind.
  Request Make(RequestKind kind, View pdu);
  Result<Bytes> CorrectionOf(const Task& task, Instant now) const;
  /// What the session needs first; nothing: the task's own request may be sent.
  std::optional<Request> ForSession(const Task& task, Instant now);
  Request Own(const Task& task, Instant now);
  Request InOtherMode();
  Request Read(std::size_t query);
  bool AsksLatchTime(const Task& task, Instant now) const;

  MeterParts& parts_;
  const Bytes address_;
  RequestKind kind_ = RequestKind::open;
  unsigned probes_ = 0;  // of a meter that has never answered
};

// What follows from a meter's replies: a table by the kind of their requests (conversation.cpp).
class MeterReplies {
 public:
  /// `parts` outlive it.
  explicit MeterReplies(MeterParts& parts) : parts_(parts) {}

  /// A reply that fits its request.
  struct Step {
    RequestKind asked;  ///< the kind of the request
    const Task& task;
    Reply reply;
    std::size_t bytes = 0;  ///< of the whole frame
    Instant now{};
  };
  Answer Take(Step step);

 private:
  struct Row;
  static const Row kRows[];
  static const Row& RowOf(RequestKind kind);

  Answer Unread(const Step& step, Answer answer);
  /// The reply answers the poll's own query.
  bool IsOwn(const Step& step) const;

  static Answer Plain(MeterReplies& its, Step& step);
  Answer TakeStatus(Step& step);
  Answer TakeData(Step& step);
  Answer TakePrelude(Step& step);
  Answer TakeRead(Step& step);
  Answer ReadRefused(Step& step);
  void AddDrift(Step& step);

  MeterParts& parts_;
};

class MeterConversation : public Conversation {
 public:
  /// `device` and `bus` outlive the conversation.
  MeterConversation(const config::Device& device, const Settings& settings, MeterBus& bus);

  std::span<const Query> Queries() const override { return parts_.reads.Queries(); }
  bool HasEvents() const override { return parts_.archive.has_events(); }
  std::optional<Instant> BackgroundDue() const override;
  void OnEventsKept(std::string_view said) override { parts_.archive.OnKept(said); }
  Result<Request> Ask(const Task& task, Instant now) override { return requests_.Next(task, now); }
  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override;
  Then OnSent(const Task& task, const Request& request, Instant now) override;
  void Stamp(Request& request, Now arrives, Duration character) override;
  void OnHostClock(bool right) override { parts_.drift.OnHostClock(right); }
  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant now) override;
  void OnReconnect() override;
  void OnEnabled() override { parts_.session.OnEnabled(); }
  const std::string& Memory() const override { return parts_.session.memory(); }
  void Recall(std::string_view memory, Now now) override { parts_.session.Recall(memory, now); }
  const DeviceTrouble& trouble() const override {
    return parts_.session.trouble() ? parts_.session.trouble() : parts_.identification.trouble();
  }
  bool ForgetRefusals() override;
  config::Timing LeastTimes(Duration character) const override;
  std::string WhatIsLearned() const override;
  Outcome Check(View request, View frame) const override { return reader_.Check(request, frame); }
  Answer Interpret(View request, View frame) override;

 private:
  MeterParts parts_;
  ReplyReader reader_;
  MeterRequests requests_;
  MeterReplies replies_;
};

}  // namespace baudgate::protocols::set4tm
