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
// KeptParts is the parsed form of this text: how far each part was read.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/conversation.h"
#include "protocols/set4tm/meter/constants.h"

namespace baudgate::protocols::set4tm {

// KeptParts is the stored state of one job: the meter's serial number (0: unknown), and for each
// part how far it was read.
//
//   9020001 1:0658:1414080200023437:30;2:0000:1314080200023337:2      load profiles 1 and 2
//   9020001 01:31301501….-;07:-.-                                     journals 01 and 07: their
//                                                                     records; '-' is an empty
//                                                                     record
struct KeptParts {
  struct Part {
    std::string name{};
    std::string text{};
  };
  std::uint32_t meter = 0;
  std::vector<Part> parts{};

  std::string Text() const;
  static std::optional<KeptParts> Parse(std::string_view said);
};

/// Finds out whether the stored parts belong to the meter that answers. If they do not, they must
/// not be used.
class KeptMeter {
 public:
  /// Call it with the serial number in the stored parts; 0: the number is unknown. Returns true if
  /// this is the number of another meter than the meter that answers.
  bool OnKept(std::uint32_t meter);
  void Forget() { kept_.reset(); }
  /// Call it with the serial number of the meter that answers. Returns true if the stored parts
  /// belong to another meter.
  bool OnMeter(std::uint32_t serial);

  std::uint32_t serial() const { return serial_.value_or(0); }
  /// True if the stored parts may belong to another meter, because the number of the meter that
  /// answers is not known yet.
  bool is_open() const { return kept_ && !serial_; }

 private:
  std::optional<std::uint32_t> serial_;
  std::optional<std::uint32_t> kept_;  // serial number of the meter whose parts are stored
};

class BackgroundJob {
 public:
  /// Pause between a failure and the next request.
  static constexpr Duration kRest = std::chrono::seconds(30);

  virtual ~BackgroundJob() = default;
  virtual bool wanted() const = 0;
  /// Returns when the next task is due. Empty: no task is due, or the stored state is not known
  /// yet.
  std::optional<Instant> due() const { return recalled_ ? NextDue() : std::nullopt; }
  /// Call it with this job's text in the latest stored batch; see Conversation::OnEventsKept.
  void OnKept(std::string_view said) {
    recalled_ = true;
    Recall(said);
  }
  virtual void OnMeter(std::uint32_t /*serial*/) {}
  virtual void OnType(std::optional<std::uint8_t> /*type*/) {}

  /// Returns the PDU to send next. Call it only when a task is due.
  Bytes Next(Instant now) {
    latest_ = now;
    return NextPdu();
  }
  /// Takes the reply to the PDU that Next returned. A batch in the answer contains only the text of
  /// this job.
  Answer Take(View data, const Scale& scale, Instant now) {
    latest_ = now;
    return TakeData(data, scale);
  }
  /// Takes the refusal of the PDU that Next returned; `answer` contains the reason.
  Answer TakeRefusal(Answer answer, Instant now) {
    latest_ = now;
    answer.readings.clear();
    return Refused(std::move(answer));
  }
  virtual void OnFailure(Instant now) = 0;
  virtual void OnReconnect() = 0;
  virtual void ForgetRefusals() = 0;
  /// Returns a text for the status: how far the job is. Empty: there is nothing to report.
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
