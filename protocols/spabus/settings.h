// The options of an SPA Bus device by name, and what they make of a reply's checksum.
// Values come from the configuration; conversation, twin and frame rules read them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/options.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/reply.h"

namespace baudgate::protocols::spabus {

inline constexpr char kMaxItems[] = "max_items";
inline constexpr char kPassword[] = "password";
inline constexpr char kSendWildcard[] = "send_xx";
inline constexpr char kAcceptWildcard[] = "accept_xx";
inline constexpr char kLineFeedInChecksum[] = "lf_in_checksum";
inline constexpr char kContinuation[] = "continuation_checksum";

/// V160 opens and V161 closes or changes the password.
inline constexpr Range kPasswordItems{160, 161};

/// As Expectation::checksum wants it.
inline int ChecksumBits(const config::Options& options) {
  const std::string& chosen = options.Text(kContinuation);
  int bits = kCoversAny;
  if (chosen == "a") bits = kCoversAll;
  if (chosen == "b") bits = kCoversNoLineEnds;
  if (chosen == "c") bits = kCoversCharacters;
  if (chosen == "d") bits = kCoversLastLine;
  if (options.Flag(kLineFeedInChecksum)) bits |= kLineFeedCovered;
  if (options.Flag(kAcceptWildcard)) bits |= kWildcardAccepted;
  return bits;
}

}  // namespace baudgate::protocols::spabus
