// `WriteJob` writes points of one device one by one, or several in one exchange if the protocol
// allows that. Each job makes one exchange that writes; the next job continues the command with the
// remaining points. WriteEndOf derives the result of a write from the outcome of its exchange.
// Compare and VerdictOn check whether a point shows the written value afterwards.
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
  /// Writes the point at index `next` of the command, together with the points after it that fit
  /// into the same exchange.
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
  void OnSend(LineContext& line, Instant now) override;
  void NoteTold(const JobEnd& told, bool may_have_acted) override;
  void OnGaveUp(const ExchangeEnd& end) override;
  void OnWithheld(const Withheld& why) override { withheld_ = why; }
  void End(const JobEnd& end, Instant now, EndEffects& effects) override;

 private:
  /// How the exchange that writes the points `first_` to `next_` - 1 ended.
  struct PointsEnd {
    WriteEnd how = WriteEnd::not_sent;
    Outcome outcome = Outcome::none;
    bool keeps_told = false;  // `outcome` comes from `told_`, not from the latest request
    // A session that the job has opened may still be open in the device.
    bool open = false;
  };

  /// True if a request was sent that may have written the points under_way().
  bool sent() const { return command_.state == WriteState::sent; }
  std::span<const PointWrite> under_way() const {
    return std::span(command_.writes()).subspan(first_, next_ - first_);
  }
  /// Sets PointWrite::before of the points under_way() to their values now.
  void NoteBefore(LineContext& line, Instant now);
  PointsEnd EndOfPoints(const JobEnd& end) const;
  EndEffects::Write EndOfWrite(const JobEnd& end, Instant now) const;

  WriteCommand command_;
  // This job writes the points `first_` to `next_` - 1 of command_.writes().
  std::size_t first_ = 0;
  std::size_t next_ = 0;
  /// The latest outcome that shows how the write went: a failure, a refusal, or the answer to a
  /// request that may write. Requests that close a session do not count.
  std::optional<JobEnd> told_;
  bool may_have_acted_ = false;           // the write was refused, but may have changed something
  bool may_have_written_before_ = false;  // the value of sent() before the latest try
  // Set if a request was not sent; the job then only closes a session that it has opened.
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

/// Returns the result of a write. `sent`: a request was sent that may have written the point.
/// `may_have_acted`: the write was refused, but may have changed something.
WriteEnd WriteEndOf(Outcome outcome, bool sent, bool may_have_acted = false);

/// The value that a point shows after a confirmed write, compared with the written value.
enum class Comparison {
  nothing,
  written,  ///< the written value; numbers may differ by rounding
  between,  ///< between the old and the new value, such as 11 while an output moves from 4 to 20
  another,
};
Comparison Compare(const config::Point& point, const PointWrite& write, const Value& shown);

struct ReadBackVerdict {
  WriteResult result;
  bool lost = false;  ///< a readable point was not read with a good value after the write
};
/// Compares the points of a confirmed command with the values in `record` that were read after the
/// write. If a point has not been read since, the result is `ok` but not `read_back`.
ReadBackVerdict VerdictOn(const WriteQueue::Confirmed& one, const DeviceRecord& record);

}  // namespace baudgate::bus
