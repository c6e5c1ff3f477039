// `JobRunner` runs the present job on the line: it gives requests to the line, has replies judged,
// and carries out the next step of the job (NextStep in gateway/bus/jobs/job.h). Each input passes
// these steps:
//
//   1  EchoWatch removes the echo of the request from the bytes.
//   2  Line returns what has happened (LineNews): a message sent unasked, a request to be sent,
//      stray bytes, the end of the exchange, a second reply. Apply passes each to its part.
//   3  OnExchangeEnd makes one value of an exchange that has ended (EndedExchange). DeviceTracker
//      learns from the value, the observers are called once, then the job decides what follows.
//   4  Do carries out step after step, until the job waits or is over.
//
// Like `Line` it has no input, output or clock. gateway/bus/poller/poller.h calls it.
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

// `ArrivalTime` returns the earliest moment at which bytes may have come that are read now. While
// bytes are awaited, the line looks for them every kLook. If a look is late, the program was
// stopped or got no CPU time, or its machine was paused: the bytes may have come at any time since
// the look before. The same holds for bytes that are read shortly after, because one read does not
// empty a port.
//
//   look before    this look    the bytes may have come
//   1.0 s          1.1 s        now
//   1.0 s          61.0 s       since 1.0 s
//                  61.4 s       since 1.0 s: they may have waited as well
//                  61.6 s       now
class ArrivalTime {
 public:
  /// Call for each input. `looks`: bytes were awaited before it.
  void OnInput(Instant now, bool looks) {
    const Instant before = std::exchange(last_, now);
    if (!looks || now - before <= kLook + kLate) return;
    if (now >= held_until_) held_since_ = before;
    held_until_ = now + kHeld;
  }
  Instant NextLook() const { return last_ + kLook; }
  /// Returns the earliest moment at which bytes may have come that were read at `read`.
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
  /// The references must stay valid for the lifetime of this object; `port` may be constructed
  /// later.
  JobRunner(config::Echo echo, LineContext& context, UnaskedSide& unasked, RequestPort& port);

  bool is_open() const { return line_.state() != Line::State::closed; }
  bool idle() const { return line_.idle(); }
  /// Returns the member of the exchange under way, or of the latest exchange. Null: there was none.
  const Member* member() const { return asks() ? job_->member : last_; }
  /// Null: no job is under way.
  Job* job() const { return job_.get(); }
  std::optional<Instant> Deadline() const;

  // ---- inputs
  /// Call before each input.
  void OnTime(Now now);
  /// `keeps_bit_rate`: see Line::OnOpened.
  void OnOpened(bool keeps_bit_rate);
  /// The job under way ends. `reason`: why the port is closed.
  void OnClosed(const std::string& reason);
  void Receive(View bytes);
  void OnEnded() { Apply(line_.OnEnded(now_.instant)); }
  void OnTimer();
  /// The client has left: its requests are answered.
  void Abandon(std::uint64_t client) {
    if (job_) job_->Abandon(client, port_.IsUnsent());
  }

  /// Call after each input. A request that waits for a quiet line may be too late now, or
  /// forbidden. The line then continues with the next request, which may belong to the same job and
  /// close what it has opened.
  void Withdraw();

  // ---- turns, while the line is idle
  /// Call only without a job. `job` is new or was parked. It gets its next request, or ends at
  /// once.
  void Begin(std::unique_ptr<Job> job);
  enum class Turn : std::uint8_t {
    send,  ///< the request is to be sent now: call Start
    wait,  ///< the line waits until no late reply can come
    next,  ///< there is another job now, or none
  };
  /// Call only with a job. Decides what happens while the line is idle.
  Turn TakeTurn();
  /// Gives the exchange to the line. `idle_since`: since when the line is idle.
  void Start(Instant idle_since);

 private:
  bool asks() const { return job_ && !job_->step.waiting; }
  /// True if bytes may come: of a reply, or of a device that sends unasked.
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
  Now now_{};  // time of the input that is being handled
  std::unique_ptr<Job> job_;
  const Member* last_ = nullptr;
};

}  // namespace baudgate::bus
