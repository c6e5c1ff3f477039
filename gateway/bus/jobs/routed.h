// `RoutedJob` forwards the request of a client of a transparent route to a slave without changes,
// and returns the reply to the client. `RoutedJobs` decides which of the waiting requests can be
// sent now; gateway/bus/writes/route_queue.h contains them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "gateway/bus/jobs/agenda.h"
#include "gateway/bus/jobs/job.h"

namespace baudgate::bus {

class RoutedJob final : public Job {
 public:
  /// `batch`: requests of clients that are answered by one reply; when a client leaves, its request
  /// is removed. `every_slave_answers`: each Modbus slave answers this function, at least with an
  /// exception, so silence means that the slave is absent.
  RoutedJob(Member& slave, RouteQueue::Batch batch, bool every_slave_answers, bool is_read,
            protocols::Request request, Instant now)
      : Job(slave, {}, now),
        batch_(std::move(batch)),
        every_slave_answers_(every_slave_answers),
        is_read_(is_read) {
    step = {.request = std::move(request), .waiting = true};
    requests = 1;
  }

  NextStep Begin() override { return NextStep::Wait(); }

  LineUse use() const override { return LineUse::routes; }
  bool is_urgent() const override {
    return first() != nullptr && RouteQueue::IsShortWrite(*first());
  }
  bool is_routed() const override { return true; }
  bool is_writing() const override { return !is_read_; }
  bool is_read() const { return is_read_; }
  /// Returns the latest deadline of the waiting clients; a time in the past if all have left.
  std::optional<Instant> LatestStart() const override;
  bool LetsPass(const LineContext& line, Instant now) const override;
  void PutBack(LineContext& line) override;
  void Abandon(std::uint64_t client, bool unsent) override;

 protected:
  Outcome JudgeForm(LineContext& line, View frame, const EchoWatch& echo) override;
  Outcome Read(View /*frame*/, Instant /*now*/) override { return attempt.answer.outcome; }
  Outcome Refuse(View /*frame*/, Outcome outcome) override {
    return attempt.answer.outcome = outcome;
  }
  NextStep Answer(LineContext& line, const ExchangeEnd& end, Now now) override;
  NextStep Fail(LineContext& line, const ExchangeEnd& end, Instant now) override;
  void End(const JobEnd& end, Instant now, EndEffects& effects) override;
  /// Called after the probe before this job: the request of the client waits for the line again.
  NextStep GoOn() override { return NextStep::Wait(); }

 private:
  const RoutedRequest* first() const { return batch_.empty() ? nullptr : &batch_.front(); }
  bool IsDeclined(const JobEnd& end) const;

  RouteQueue::Batch batch_;
  const bool every_slave_answers_;
  const bool is_read_;
  Bytes reply_;
  bool odd_ = false;  // the slave has answered in a form that does not fit the request
  // The lost requests that the latest reply may answer in place of the present request.
  LostReplies::Older older_;
  std::size_t replies_ = 0;
};

class RoutedJobs {
 public:
  /// All references must stay valid for the lifetime of this object.
  RoutedJobs(Roster& roster, Agenda& agenda, const LateReplies& late)
      : roster_(roster), agenda_(agenda), late_(late) {}

  Turns::Waiting Waiting() const;
  /// True if a waiting request of a client can be sent now; MayGo in gateway/bus/jobs/routed.cpp
  /// has the conditions.
  bool AnyMayGo(Instant now) const;
  bool ShortWriteMayGo(Instant now) const;
  /// True if a short write (a start or stop) waits for a slave that is not offline. Short writes
  /// for offline slaves wait for a probe, so they need not be sent before other requests.
  bool ShortWriteWaits() const;
  /// True if a client waits for this offline slave, so that probes of it are useful.
  bool IsLookedFor(const Member& slave, const Idle& idle) const;

  // Each Take function returns null if no request of its kind can be sent now.
  std::unique_ptr<RoutedJob> Take(config::Priority priority, Instant now);
  std::unique_ptr<RoutedJob> TakeUrgent(Instant now);
  /// Returns a short write for this slave, even if the slave is offline, or null.
  std::unique_ptr<RoutedJob> TakeShortWrite(std::uint8_t slave, Instant now);
  /// Returns a job that sends a waiting request of a client to the offline slave, as its probe. If
  /// no request waits, the job repeats the last read of a client (RoutedSide::MayRepeatRead). Null:
  /// there is neither.
  std::unique_ptr<RoutedJob> TakeProbe(const Member& slave, const Idle& idle);

 private:
  bool MayGo(const RoutedRequest& request, Instant now) const;
  std::unique_ptr<RoutedJob> JobOf(RouteQueue::Batch batch, Instant now);

  Roster& roster_;
  Agenda& agenda_;
  const LateReplies& late_;
};

class ShortWriteSource final : public JobSource {
 public:
  explicit ShortWriteSource(LineContext& line) : line_(line) {}

  std::unique_ptr<Job> Take(const Idle& idle) override;
  /// Returns the next time for all requests of routes, including those of RoutedSource.
  std::optional<Instant> NextAt(const Idle& idle) const override;

 private:
  LineContext& line_;
};

class RoutedSource final : public JobSource {
 public:
  RoutedSource(RoutedJobs& jobs, config::Priority priority) : jobs_(jobs), priority_(priority) {}

  std::unique_ptr<Job> Take(const Idle& idle) override { return jobs_.Take(priority_, idle.now); }
  /// Always empty, because ShortWriteSource::NextAt covers all requests of routes.
  std::optional<Instant> NextAt(const Idle& /*idle*/) const override { return std::nullopt; }

 private:
  RoutedJobs& jobs_;
  const config::Priority priority_;
};

}  // namespace baudgate::bus
