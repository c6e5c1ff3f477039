// MeterConversation is the conversation with one SET-4TM meter. MeterParts contains the parts of
// its state, MeterRequests decides which request is next, MeterReplies what follows from a reply,
// and protocols/set4tm/meter/point_reads.h decodes replies.
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

// MeterParts contains the state of one meter and the jobs that read it, for MeterRequests and
// MeterReplies.
struct MeterParts {
  /// `its_device` and `bus` must outlive this object.
  MeterParts(const config::Device& its_device, const Settings& its_settings, MeterBus& bus)
      : device(its_device),
        settings(its_settings),
        identification(device, settings),
        reads(device, settings, identification),
        latched(settings.latch, bus.latch),
        archive(device.events, settings, identification),
        session(settings) {}

  const config::Device& device;
  /// Forgets which requests the meter has refused, except the requests of points, so that they are
  /// sent again. `journals`: see MeterArchive::ForgetRefusals.
  void ForgetRefusals(bool journals) {
    identification.ForgetRefusals();
    archive.ForgetRefusals(journals);
    latched.ForgetRefusals();
    reads.TryMasks();
  }

  const Settings settings;
  /// When to retry refused requests that read no point: constants, masks, load profiles.
  TryAgain refused;
  Identification identification;
  PointReads reads;
  ClockDrift drift;
  LatchedReads latched;
  MeterArchive archive;
  MeterSession session;
};

// MeterRequests decides which request is sent to a SET-4TM meter next: first the requests that the
// task depends on, then the request of the task itself.
//
//   a poll of 08 1B 00 11     > 05 01 30 30 …    open the channel
//                             > 05 08 00         ask the serial number
//                             > 05 08 12         ask the type, which decides which floats exist
//                             > 05 08 1B 00 11

enum class RequestKind : std::uint8_t {
  latch,  ///< the latch broadcast, which no meter answers
  link,
  /// Asks for the serial number in the other checksum mode. The reply only shows in the status that
  /// the option checksum is wrong.
  other_mode,
  open,
  serial,
  question,  ///< asks for the type or the ratios before a request that depends on them
  /// Asks for the time of the latest latch, which shows whether the broadcast was received.
  latch_time,
  record,      ///< reads a record of a journal
  background,  ///< reads a load profile or a billing reading
  trial,       ///< a masked read that tests whether the meter supports masks
  read,        ///< reads a query of points
  write,       ///< corrects the clock
};

class MeterRequests {
 public:
  explicit MeterRequests(MeterParts& parts);

  /// Returns the next request of the task, or an error if the task's value cannot be written.
  Result<Request> Next(const Task& task, Instant now);
  RequestKind kind() const { return kind_; }

 private:
  Request Make(RequestKind kind, View pdu);
  Result<Bytes> CorrectionOf(const Task& task, Instant now) const;
  /// Returns the request that the session needs first (MeterSession::Need). Empty: the task's own
  /// request can be sent.
  std::optional<Request> ForSession(const Task& task, Instant now);
  Request Own(const Task& task, Instant now);
  Request InOtherMode();
  Request Read(std::size_t query);
  bool AsksLatchTime(const Task& task, Instant now) const;

  MeterParts& parts_;
  const Bytes address_;
  RequestKind kind_ = RequestKind::open;
  unsigned probes_ = 0;  // number of probes that were sent to a meter that has never answered
};

// MeterReplies decides how a task continues after a reply of a SET-4TM meter, by a table of request
// kinds (protocols/set4tm/conversation.cpp).
class MeterReplies {
 public:
  explicit MeterReplies(MeterParts& parts) : parts_(parts) {}

  struct Step {
    RequestKind asked;
    const Task& task;
    Reply reply;
    std::size_t bytes = 0;
    Instant now{};
  };
  Answer Take(Step step);

 private:
  struct Row;
  static const Row kRows[];
  static const Row& RowOf(RequestKind kind);

  Answer Unread(const Step& step, Answer answer);
  /// True if the reply answers the query of the poll itself, not a request before it.
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
