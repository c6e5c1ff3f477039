// The SPA Bus as the poller sees it: one bus per line, one conversation per device on it.
// Tasks come in, requests go to the line; frames come back from it and leave as readings.
// RelayIdentity checks that a relay is what its profile says.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

#include "config/model/device.h"
#include "protocols/conversation.h"
#include "protocols/protocol.h"
#include "protocols/spabus/clock.h"
#include "protocols/spabus/reply.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {

// Whether a relay is what its profile says, by its designation (item F):
//
//   > >7RF:    < <7D: SPAJ 140C:      it is asked before the first poll
//                                     another name: it is asked for nothing else until it is right
//
class RelayIdentity {
 public:
  /// It outlives this.
  explicit RelayIdentity(const config::Identity& identity) : identity_(identity) {}

  /// A request is asked for: an earlier one that waits will be asked for again.
  void OnAsk() { asked_ = false; }
  /// True: the next request asks for the name.
  bool WantsName();
  /// The request under way asks for the name, and is answered or has failed.
  bool TakeAsked() { return std::exchange(asked_, false); }
  Answer TakeName(Answer answer);
  /// Silence contradicts nothing; the next poll asks for values.
  void OnNoName() { named_ = true; }
  void OnReconnect() { named_ = false; }
  const DeviceTrouble& trouble() const { return trouble_; }

 private:
  const config::Identity& identity_;
  bool named_ = false;  ///< it has said what it is, since OnReconnect
  bool asked_ = false;
  DeviceTrouble trouble_;
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
