// Something that a meter's conversation does when nothing else is due, one exchange a task: reads
// load profiles, billing readings. Fed with what is kept and with replies.
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
  virtual ~BackgroundJob() = default;
  /// The configuration asks for it.
  virtual bool wanted() const = 0;
  /// From when on a task is wanted; nothing: none is, or nobody has said yet what is kept.
  virtual std::optional<Instant> due() const = 0;
  /// What the latest batch that is kept has said of this; see Conversation::OnEventsKept.
  virtual void OnKept(std::string_view said) = 0;
  /// The serial number of the meter that answers.
  virtual void OnMeter(std::uint32_t serial) = 0;
  /// Of the type of the meter; nothing: it is not known.
  virtual void OnType(std::optional<std::uint8_t> /*type*/) {}

  /// due(): the PDU to be sent next.
  virtual Bytes Next(Instant now) = 0;
  /// They answer the PDU of Next. A batch says only what concerns this.
  virtual Answer OnData(View data, const Scale& scale, Instant now) = 0;
  virtual Answer OnRefused(Answer answer, Instant now) = 0;
  virtual void OnFailure(Instant now) = 0;
  virtual void OnReconnect() = 0;
  /// For the status; empty: there is nothing to say.
  virtual std::string Shown() const = 0;
};

}  // namespace baudgate::protocols::set4tm
