// The SPA Bus as the poller sees it: one bus per line, one conversation per device on it.
// Tasks come in, requests go to the line; frames come back from it and leave as readings.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "protocols/conversation.h"
#include "protocols/protocol.h"
#include "protocols/spabus/clock_messages.h"
#include "protocols/spabus/reply.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {

/// Which reading of the checksum of continued replies the devices of a line use (reply.h). Shared
/// by their conversations; each match narrows it down.
class ContinuationChecksum {
 public:
  /// Bits that a reply may match from now on.
  int accepted() const { return accepted_; }
  /// A continued reply passed; `matching` are the readings under which it did.
  void Confirm(int matching);
  /// A reply was damaged. Three in a row, and what was learned may itself be the mistake.
  void Doubt();
  void Forget();
  /// Of the one that is left: 'a' to 'd'; 0 while there are several.
  char letter() const;

 private:
  int accepted_ = kCoversAny;
  int doubts_ = 0;
};

/// What the devices of a line share.
struct SpaBus final : Bus {
  ContinuationChecksum checksum;
  ClockMessages clock;
};

/// `device` and `bus` outlive the conversation.
std::unique_ptr<Conversation> MakeConversation(const config::Device& device,
                                               const Settings& settings, SpaBus& bus);

}  // namespace baudgate::protocols::spabus
