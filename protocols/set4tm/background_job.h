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
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "protocols/conversation.h"
#include "protocols/set4tm/constants.h"

namespace baudgate::protocols::set4tm {

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
