// The SPA Bus as the poller sees it: one bus per line, one conversation per device on it.
// Tasks come in, requests go to the line; frames come back from it and leave as readings.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "protocols/conversation.h"
#include "protocols/protocol.h"
#include "protocols/spabus/clock_messages.h"
#include "protocols/spabus/continuation_checksum.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {

/// What the devices of a line share.
struct SpaBus final : Bus {
  ContinuationChecksum checksum;
  ClockMessages clock;
};

/// `device` and `bus` outlive the conversation.
std::unique_ptr<Conversation> MakeConversation(const config::Device& device,
                                               const Settings& settings, SpaBus& bus);

}  // namespace baudgate::protocols::spabus
