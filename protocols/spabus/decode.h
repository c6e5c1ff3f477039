// What one exchange means: the pure function behind live polling and `baudgate decode` alike.
// A request and the frame that answered it go in, an Answer comes out.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "protocols/conversation.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/points.h"
#include "protocols/spabus/reply.h"

namespace baudgate::protocols::spabus {

struct Exchange {
  Answer answer;
  std::optional<Command> command;  ///< what was asked, when the request could be read
  std::optional<int> nack;         ///< the code, when the right slave refused
  std::string data;                ///< of an answered read, as it came
};

/// Readings carry the index of each point of `points` with the item's address, or a label where
/// there is none. A single item that the slave does not have gives one reading of bad
/// configuration.
Exchange Decode(View request, View frame, std::span<const ReadPoint> points);

/// What a write has set, value by value, with labels: "S21 written". Nothing of the password.
std::vector<Reading> WrittenBy(const Command& command);

}  // namespace baudgate::protocols::spabus
