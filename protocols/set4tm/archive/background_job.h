// BackgroundJob reads a part of the meter's archive (load profiles, billing readings) when nothing
// else is due, with one exchange per task. A job returns the next request, takes its reply, and
// learns which of its batches are stored on the disk:
//
//   Next(now)               08 04
//   Take(data, …)           the position of the newest record
//   Next(now)               06 03 06 58 18
//   Take(data, …)           a batch of records, and the text with which a restart continues
//   OnKept("9020001 1:…")   the batch is stored
//
// KeptParts is that text: how far each part was read.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/conversation.h"
#include "protocols/set4tm/meter/constants.h"

namespace baudgate::protocols::set4tm {

// KeptParts is the stored state of one job: the meter's serial number, and for each part how far it
// was read. Number 0: unknown.
//
//   9020001 1:0658:1414080200023437:30;2:0000:1314080200023337:2      load profiles 1 and 2
//   9020001 01:31301501….-;07:-.-                                     journals 01 and 07
struct KeptParts {
  struct Part {
    std::string name{};
    std::string text{};
  };
  std::uint32_t meter = 0;
  std::vector<Part> parts{};

  std::string Text() const;
  /// Returns nothing if `said` is no such text.
  static std::optional<KeptParts> Parse(std::string_view said);
};

/// Compares the meter of the stored parts with the meter that answers: the state of another meter
/// is not used.
class KeptMeter {
 public:
  /// Call with the meter of the stored parts; 0: unknown. Returns true if another meter answers.
  bool OnKept(std::uint32_t meter);
  /// Call if no valid text is stored.
  void Forget() { kept_.reset(); }
  /// Call with the number of the meter that answers. True: the stored parts are another meter's.
  bool OnMeter(std::uint32_t serial);

  /// The meter that answers; 0: unknown.
  std::uint32_t serial() const { return serial_.value_or(0); }
  /// True if the stored parts may be another meter's: the present number is not known yet.
  bool is_open() const { return kept_ && !serial_; }

 private:
  std::optional<std::uint32_t> serial_;  // serial number of the meter that answers
  std::optional<std::uint32_t> kept_;    // serial number of the meter whose parts are stored
};

class BackgroundJob {
 public:
  /// Pause between a failure and the next request.
  static constexpr Duration kRest = std::chrono::seconds(30);

  virtual ~BackgroundJob() = default;
  /// True if the configuration asks for this job.
  virtual bool wanted() const = 0;
  /// Returns when a task is due. Empty: none is, or the stored state is not known yet.
  std::optional<Instant> due() const { return recalled_ ? NextDue() : std::nullopt; }
  /// Call with this job's text in the latest stored batch; see Conversation::OnEventsKept.
  void OnKept(std::string_view said) {
    recalled_ = true;
    Recall(said);
  }
  virtual void OnMeter(std::uint32_t /*serial*/) {}
  /// Call with the type of the meter; empty: unknown.
  virtual void OnType(std::optional<std::uint8_t> /*type*/) {}

  /// Returns the PDU to send next. Call only when due().
  Bytes Next(Instant now) {
    latest_ = now;
    return NextPdu();
  }
  /// Takes the reply to the PDU of Next. A batch in the answer contains only the text of this job.
  Answer Take(View data, const Scale& scale, Instant now) {
    latest_ = now;
    return TakeData(data, scale);
  }
  /// Takes the refusal of the PDU of Next; `answer` contains the reason.
  Answer TakeRefusal(Answer answer, Instant now) {
    latest_ = now;
    answer.readings.clear();
    return Refused(std::move(answer));
  }
  virtual void OnFailure(Instant now) = 0;
  virtual void OnReconnect() = 0;
  virtual void ForgetRefusals() = 0;
  /// Describes the progress, for the status. Empty: nothing to report.
  virtual std::string Shown() const = 0;

 protected:
  Instant latest() const { return latest_; }

 private:
  virtual std::optional<Instant> NextDue() const = 0;
  virtual void Recall(std::string_view said) = 0;
  virtual Bytes NextPdu() = 0;
  virtual Answer TakeData(View data, const Scale& scale) = 0;
  virtual Answer Refused(Answer answer) = 0;

  bool recalled_ = false;
  Instant latest_{};
};

}  // namespace baudgate::protocols::set4tm
