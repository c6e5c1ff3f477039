// JobRunner runs the job under way on the line: gives the line its requests, has its replies
// judged, and carries out the next step of the job (NextStep in gateway/bus/jobs/job.h). What comes
// of each input, in this order:
//
//   1  the echo of the request is taken out of the bytes (EchoWatch)
//   2  Line says what has happened (LineNews): a message sent unasked, a request to be sent, stray
//      bytes, the end of the exchange, a second reply. Apply passes each to the part that it is
//      for.
//   3  OnExchangeEnd makes one value of an exchange that has ended (EndedExchange). DeviceTracker
//      learns from the value, the observers are told once, and then the job decides what follows.
//   4  Do carries out one step after the other, until the job waits or is over.
//
// Sans-I/O as the line. Driven by gateway/bus/poller/poller.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "config/model/line.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/jobs/line_context.h"
#include "gateway/bus/jobs/unasked.h"

namespace baudgate::bus {

// Since when bytes that are read now may have been waiting. While bytes are awaited, the line looks
// for them every kLook. If a look is late, the program was stopped or starved, or its machine was
// paused: what is read then may have come at any time since the look before. The same holds for
// what is read directly behind, because one read does not empty a port.
//
//   look before    this look    what is read has come
//   1.0 s          1.1 s        now
//   1.0 s          61.0 s       since 1.0 s
//                  61.4 s       since 1.0 s: it may have waited as well
//                  61.6 s       now
class ArrivalTime {
 public:
  /// An input comes; `looks`: bytes were awaited before it.
  void OnInput(Instant now, bool looks) {
    const Instant before = std::exchange(last_, now);
    if (!looks || now - before <= kLook + kLate) return;
    if (now >= held_until_) held_since_ = before;
    held_until_ = now + kHeld;
  }
  /// When the next input is due, while bytes are awaited.
  Instant NextLook() const { return last_ + kLook; }
  /// When bytes that were read at this moment have come at the earliest.
  Instant Earliest(Instant read) const {
    return read >= held_since_ && read < held_until_ ? held_since_ : read;
  }

 private:
  static constexpr Duration kLook = 100ms;
  static constexpr Duration kLate = 100ms;
  static constexpr Duration kHeld = 500ms;

  Instant last_{};
  Instant held_since_{};
  Instant held_until_{};
};

class JobRunner final : private LineClient {
 public:
  /// The references must stay valid for the lifetime of this object; `port` may be made later.
  JobRunner(config::Echo echo, LineContext& context, UnaskedSide& unasked, RequestPort& port);

  bool is_open() const { return line_.state() != Line::State::closed; }
  bool idle() const { return line_.idle(); }
  /// The member of the exchange under way, or else of the latest one. Null: there was none.
  const Member* member() const { return asks() ? job_->member : last_; }
  /// Null: no job is under way.
  Job* job() const { return job_.get(); }
  /// When OnTimer is due.
  std::optional<Instant> Deadline() const;

  // ---- inputs
  /// Before each input.
  void OnTime(Now now);
  /// `keeps_bit_rate`: see Line::OnOpened.
  void OnOpened(bool keeps_bit_rate);
  /// The job under way ends; `reason`: why the port is closed.
  void OnClosed(const std::string& reason);
  void Receive(View bytes);
  /// The server has ended the connection.
  void OnEnded() { Apply(line_.OnEnded(now_.instant)); }
  void OnTimer();
  /// The client has left: its requests are answered.
  void Abandon(std::uint64_t client) {
    if (job_) job_->Abandon(client, port_.IsUnsent());
  }

  /// After each input. A request that waits for a quiet line may be too late by now, or forbidden.
  /// Then the line begins again with the next request, also if that is one of the same job that
  /// closes what the job has opened.
  void Withdraw();

  // ---- turns, while the line is idle
  /// Only without a job. The job, a new one or one that was parked, gets its next request, or ends
  /// at once.
  void Begin(std::unique_ptr<Job> job);
  enum class Turn : std::uint8_t {
    send,  ///< its request, now: call Start
    wait,  ///< until no late reply can come
    next,  ///< there is another job now, or none
  };
  /// There is a job.
  Turn TakeTurn();
  /// The line is given the exchange. `idle_since`: since when the line is idle.
  void Start(Instant idle_since);

 private:
  /// The exchange of a request is under way.
  bool asks() const { return job_ && !job_->step.waiting; }
  /// Bytes may come: of a reply, or of a device that speaks unasked.
  bool IsAwaiting() const { return is_open() && (asks() || unasked_.listens()); }
  bool waits_for_quiet() const { return line_.state() == Line::State::quiet; }

  Outcome Judge(View frame, Instant now) override;
  void Date(LineNews& news) const;
  void Apply(LineNews news);
  void Send();
  void HandleStray(const StrayBytes& stray);
  void OnExchangeEnd(ExchangeEnd end);
  void DropUnsent(ExchangeEnd& end);
  void Do(NextStep step);
  NextStep Continue(Job::After after);

  LineContext& context_;
  UnaskedSide& unasked_;
  RequestPort& port_;
  Line line_{*this};
  EchoWatch echo_;
  ArrivalTime arrival_;
  Now now_{};                     // of the input that is being handled
  std::unique_ptr<Job> job_;      // under way
  const Member* last_ = nullptr;  // whose exchange ended last
};

}  // namespace baudgate::bus
