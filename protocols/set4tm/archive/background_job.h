// Something that a meter keeps itself and that is read when nothing else is due, one exchange a
// task: load profiles, billing readings. A job gives the next request, takes its reply, and learns
// which of its batches are on the disk:
//
//   Next(now)               08 04
//   Take(data, …)           where the newest record is
//   Next(now)               06 03 06 58 18
//   Take(data, …)           a batch of records, and the text that tells a later start where to go
//   on OnKept("9020001 1:…")   the batch is on the disk
//
// KeptParts is what a batch says of how far each part was read.
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

// What a batch says of one kind of what a meter keeps: the meter's serial number, and for each part
// how far it was read. 0: the meter does not tell its number.
//
//   9020001 1:0658:1414080200023437:30;2:0000:1314080200023337:2      load profiles 1 and 2
//   9020001 01:31301501….-;07:-.-                                     journals 01 and 07
//
struct KeptParts {
  struct Part {
    std::string name{};
    std::string text{};
  };
  std::uint32_t meter = 0;
  std::vector<Part> parts{};

  std::string Text() const;
  /// Empty: it is no such text.
  static std::optional<KeptParts> Parse(std::string_view said);
};

/// Which meter has left the parts that are kept, and whether it is the one that answers: what was
/// read of another meter says nothing of this one.
class KeptMeter {
 public:
  /// Parts of this meter are kept; 0: it did not tell its number. True: another meter answers.
  bool OnKept(std::uint32_t meter);
  /// Nothing is kept that can be understood.
  void Forget() { kept_.reset(); }
  /// This meter answers. True: what is kept is another's.
  bool OnMeter(std::uint32_t serial);

  /// The meter that answers; 0: it is not known.
  std::uint32_t serial() const { return serial_.value_or(0); }
  /// What is kept may be another meter's: none has told its number yet.
  bool is_open() const { return kept_ && !serial_; }

 private:
  std::optional<std::uint32_t> serial_;  // of the meter that answers
  std::optional<std::uint32_t> kept_;    // of the meter whose parts are kept
};

class BackgroundJob {
 public:
  /// From a failure to the next request.
  static constexpr Duration kRest = std::chrono::seconds(30);

  virtual ~BackgroundJob() = default;
  /// The configuration asks for it.
  virtual bool wanted() const = 0;
  /// From when on a task is wanted; empty: none is, or nobody has said yet what is kept.
  std::optional<Instant> due() const { return recalled_ ? NextDue() : std::nullopt; }
  /// What the latest batch that is kept has said of this; see Conversation::OnEventsKept.
  void OnKept(std::string_view said) {
    recalled_ = true;
    Recall(said);
  }
  /// The serial number of the meter that answers.
  virtual void OnMeter(std::uint32_t /*serial*/) {}
  /// The type of the meter; empty: it is not known.
  virtual void OnType(std::optional<std::uint8_t> /*type*/) {}

  /// due(): the PDU to be sent next.
  Bytes Next(Instant now) {
    latest_ = now;
    return NextPdu();
  }
  /// `data` answer the PDU of Next. A batch says only what concerns this job.
  Answer Take(View data, const Scale& scale, Instant now) {
    latest_ = now;
    return TakeData(data, scale);
  }
  /// The meter refuses the PDU of Next: `answer` says why.
  Answer TakeRefusal(Answer answer, Instant now) {
    latest_ = now;
    answer.readings.clear();
    return Refused(std::move(answer));
  }
  /// The PDU of Next was not answered.
  virtual void OnFailure(Instant now) = 0;
  virtual void OnReconnect() = 0;
  /// Lets everything that the meter has refused be asked again.
  virtual void ForgetRefusals() = 0;
  /// For the status; empty: there is nothing to say.
  virtual std::string Shown() const = 0;

 protected:
  /// When the latest exchange was.
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
