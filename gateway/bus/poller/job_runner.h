// `JobRunner` runs the present job on the line: it gives requests to the line, lets the job judge
// the replies, and carries out the next step of the job (NextStep in gateway/bus/jobs/job.h).
// Received bytes and expired timers pass these steps:
//
//   1  EchoWatch removes the echo of the request from the bytes.
//   2  Line returns what has happened (LineNews): a message sent unasked, a request to be sent,
//      stray bytes, the end of the exchange, a second reply. Apply calls the part that handles
//      each.
//   3  OnExchangeEnd makes one value of an exchange that has ended (EndedExchange). DeviceTracker
//      learns from it, then all observers get it, then the job decides about its next step.
//   4  Do carries out step after step, until the job waits or is over.
//
// It has no I/O and no clock. `Poller` (gateway/bus/poller/poller.h) calls it.
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

// `ArrivalTime` estimates when bytes arrived that are read now. While bytes are expected, the
// program looks for them at least every 100 ms. If the next look comes much later, the program was
// stopped or had no CPU time, and the bytes may have arrived at any time since the look before. The
// same holds for bytes that are read up to 500 ms later, because one read does not empty a port.
// Example:
//
//   look before    this look    the bytes may have come
//   1.0 s          1.1 s        now
//   1.0 s          61.0 s       since 1.0 s
//                  61.4 s       since 1.0 s: they may have waited as well
//                  61.6 s       now
class ArrivalTime {
 public:
  /// Call for each input. `looks`: bytes have been expected since the input before.
  void OnInput(Instant now, bool looks) {
    const Instant before = std::exchange(last_, now);
    if (!looks || now - before <= kLook + kLate) return;
    if (now >= held_until_) held_since_ = before;
    held_until_ = now + kHeld;
  }
  Instant NextLook() const { return last_ + kLook; }
  /// Returns the earliest time at which bytes can have arrived that were read at `read`.
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
  /// The references must stay valid for the lifetime of this object. `port` is not used by the
  /// constructor, so it can be constructed later.
  JobRunner(config::Echo echo, LineContext& context, UnaskedSide& unasked, RequestPort& port);

  bool is_open() const { return line_.state() != Line::State::closed; }
  bool idle() const { return line_.idle(); }
  /// Returns the device of the exchange under way, or of the latest exchange. Null: there was no
  /// exchange yet.
  const Member* member() const { return asks() ? job_->member : last_; }
  Job* job() const { return job_.get(); }
  std::optional<Instant> Deadline() const;

  // ---- inputs
  /// Call before each of the functions below, with the present time.
  void OnTime(Now now);
  /// `keeps_bit_rate`: the port sends and receives at its bit rate; see Line::OnOpened.
  void OnOpened(bool keeps_bit_rate);
  /// The port was closed, so the job under way ends. `reason`: why it was closed, as text.
  void OnClosed(const std::string& reason);
  void Receive(View bytes);
  void OnEnded() { Apply(line_.OnEnded(now_.instant)); }
  void OnTimer();
  /// The client has left. Its requests in the present job are answered.
  void Abandon(std::uint64_t client) {
    if (job_) job_->Abandon(client, port_.IsUnsent());
  }

  /// Call after each input. If the request of the job waits for silence and must not be sent any
  /// more (too late, forbidden), the job continues with its next step, for example a request that
  /// closes a session, or ends.
  void Withdraw();

  // ---- turns, while the line is idle
  /// Makes `job` the present job, which is new or was parked. The job gets its request, or ends at
  /// once. Call only while there is no job.
  void Begin(std::unique_ptr<Job> job);
  enum class Turn : std::uint8_t {
    send,  ///< the request is to be sent now: call Start
    wait,  ///< the line stays idle until no late reply can come
    /// The job has ended or is parked, or has a new request. If there is no job, choose one; then
    /// call TakeTurn again.
    next,
  };
  /// Decides whether the request of the present job is sent now. Call only with a job, while the
  /// line is idle.
  Turn TakeTurn();
  /// Gives the request to the line. `idle_since`: the line has been idle since then.
  void Start(Instant idle_since);

 private:
  bool asks() const { return job_ && !job_->step.waiting; }
  /// True if bytes are expected: a reply, or messages of a device that sends unasked.
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
