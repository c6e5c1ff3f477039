// What DDS Security puts into datagrams, as far as it can be looked at without keys: the order and
// lengths of its submessages, and the messages of the handshake, which are in clear text. Pure;
// gateway/outputs/dds/fast/datagram_check.h calls it. Source: DDS Security 1.1, 7.3.6 and 9.5.3.3.
//
//   52 54 50 53 … | 33 SRTPS_PREFIX | 30 SEC_BODY, encrypted | 34 SRTPS_POSTFIX
//   52 54 50 53 … | 31 SEC_PREFIX | 30 SEC_BODY, or a submessage that is signed | 32 SEC_POSTFIX
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/rtps/rtps_fields.h"

namespace baudgate::dds {

enum class Secured : std::uint8_t {
  off,       ///< nothing of DDS Security is let in
  allowed,   ///< let in when it is well formed
  demanded,  ///< and in clear text only announcements and handshakes
};

/// Whether the fields of a secured submessage fit into it. `id` is one of kFirstSecured…
bool SecuredFits(std::uint8_t id, const RtpsFields& body);

/// Follows the submessages of one datagram.
class SecuredOrder {
 public:
  /// False: `id` cannot stand here. `first`: it is the first of the datagram.
  bool Next(std::uint8_t id, bool first);
  /// What was begun has been ended.
  bool complete() const { return !message_ && step_ == Step::outside; }
  /// The next submessage is under a signature, unless it ends what is.
  bool open() const { return message_ || step_ == Step::prefix; }
  /// The submessage that Next was told of last is.
  bool inside() const { return inside_; }

 private:
  enum class Step : std::uint8_t { outside, prefix, body };

  Step step_ = Step::outside;
  bool message_ = false;  ///< between SRTPS_PREFIX and SRTPS_POSTFIX
  bool ended_ = false;    ///< behind SRTPS_POSTFIX
  bool inside_ = false;
};

/// ParticipantGenericMessage: ids, a class and a sequence of tokens. `payload` begins behind the
/// encapsulation.
bool IsGenericMessage(View payload, bool little);

/// Each message of a handshake may cost the library a signature: 512 at once and 128 a second after
/// that, half as many from one address.
class HandshakeBudget {
 public:
  HandshakeBudget();
  bool Take(std::uint32_t address, Instant now);

 private:
  struct Source {
    std::uint32_t address = 0;
    Instant full_at{};
  };
  std::vector<Source> sources_;
  Instant full_at_{};
};

}  // namespace baudgate::dds
