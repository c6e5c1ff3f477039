// `WriteJob` writes points of one device one by one, or several in one exchange if the protocol
// allows that. The job ends with each exchange that writes; another job continues the command.
// WriteEndOf returns the result of a write from the outcome of its exchange. Compare and VerdictOn
// judge a confirmed write by the values that its points show afterwards.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "config/model/point.h"
#include "gateway/base/outcome.h"
#include "gateway/base/value.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/bus/writes/write_queue.h"

namespace baudgate::bus {

class WriteJob : public Job {
 public:
  /// Writes the point at index `next` of the command, and the points after it that fit into the
  /// same exchange.
  WriteJob(Member& who, WriteCommand command, Instant now, std::size_t next = 0);

  LineUse use() const override { return LineUse::writes; }
  bool is_urgent() const override { return true; }
  bool writes() const override { return true; }
  bool is_writing() const override { return true; }
  std::optional<Instant> LatestStart() const override;
  std::optional<Instant> RepeatsUntil() const override { return command_.deadline; }
  std::optional<Withheld> WhyNotSend(Instant now, bool held = false) const override;
  void NeverLeft() override;
  After Finish(LineContext& line, const JobEnd& end, Instant now) override;

 protected:
  void OnSend(LineContext& line) override;
  void NoteTold(const JobEnd& told, bool may_have_acted) override;
  void OnGaveUp(const ExchangeEnd& end) override;
  void OnWithheld(const Withheld& why) override { withheld_ = why; }
  void End(const JobEnd& end, Instant now, EndEffects& effects) override;

 private:
  /// How the exchange of the points under way ended.
  struct PointsEnd {
    WriteEnd how = WriteEnd::not_sent;
    Outcome outcome = Outcome::none;
    bool keeps_told = false;  // `outcome` is the outcome before the latest request
    // The device may still have open what the job opened (a session, a password).
    bool open = false;
  };

  /// True if a request was sent that may have written the points under way.
  bool sent() const { return command_.state == WriteState::sent; }
  std::span<const PointWrite> under_way() const {
    return std::span(command_.writes()).subspan(first_, next_ - first_);
  }
  PointsEnd EndOfPoints(const JobEnd& end) const;
  EndEffects::Write EndOfWrite(const JobEnd& end, Instant now) const;

  WriteCommand command_;
  std::size_t first_ = 0;  // index in command.writes() of the first point under way
  std::size_t next_ = 0;   // index of the first point that was not begun
  /// The latest failure, refusal, or answer to a request that may write. After it only closing
  /// requests were sent.
  std::optional<JobEnd> told_;
  bool may_have_acted_ = false;           // see protocols::Answer
  bool may_have_written_before_ = false;  // sent() before the latest try
  // Set if a request was not sent, and what is open is closed now.
  std::optional<Withheld> withheld_;
};

class WriteSource final : public JobSource {
 public:
  explicit WriteSource(LineContext& line) : line_(line) {}

  std::unique_ptr<Job> Take(const Idle& idle) override;
  std::optional<Instant> NextAt(const Idle& idle) const override;

 private:
  LineContext& line_;
};

/// `sent`: a request that may have written was sent. `may_have_acted`: see protocols::Answer.
WriteEnd WriteEndOf(Outcome outcome, bool sent, bool may_have_acted = false);

/// The result of comparing the value that a point shows with the value that was written and
/// confirmed.
enum class Comparison {
  nothing,
  written,  ///< the written value; numbers may differ by rounding
  between,  ///< between the old and the written value: an output on its way from 4 to 20 shows 11
  another,
};
Comparison Compare(const config::Point& point, const PointWrite& write, const Value& shown);

struct ReadBackVerdict {
  WriteResult result;
  bool lost = false;  ///< an expected reading did not come
};
/// Returns the verdict on a command that its device has confirmed, from the values that `record`
/// shows since then. A point that has not been read decides nothing.
ReadBackVerdict VerdictOn(const WriteQueue::Confirmed& one, const DeviceRecord& record);

}  // namespace baudgate::bus
