// What a frame from a meter means for the request that it answers, whatever the session:
//
//   > 05 08 00 66 01   < 05 00 89 A2 61 …     data: the serial number
//   > 05 08 00 66 01   < 05 05 81 C3          status 05: the channel is closed
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "protocols/conversation.h"
#include "protocols/set4tm/meter/identification.h"
#include "protocols/set4tm/meter/plan.h"
#include "protocols/set4tm/meter/settings.h"

namespace baudgate::protocols::set4tm {

struct Reply {
  Answer answer;
  View pdu;                            ///< of the request; empty when the frame does not answer it
  std::optional<std::uint8_t> status;  ///< a one-byte reply
  View data;                           ///< any other
};

class ReplyReader {
 public:
  /// All outlive it.
  ReplyReader(const Settings& settings, const PointFields& fields,
              const Identification& identification)
      : settings_(settings), fields_(fields), identification_(identification) {}

  Reply Read(View request, View frame) const;
  /// See Conversation::Check.
  Outcome Check(View request, View frame) const;

 private:
  bool Accepts(View asked, View answering) const;
  void ReadStatus(Reply& reply) const;
  void ReadData(Reply& reply) const;

  const Settings& settings_;
  const PointFields& fields_;
  const Identification& identification_;
};

}  // namespace baudgate::protocols::set4tm
