// What a refusal of a slave (NACK 0…9) means and what the master does about it.
// Codes come from reply.h and end as outcomes and sentences for the log.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"

namespace baudgate::protocols::spabus {

/// Codes of refusals that are met by their number: the message asks for too much; it is not
/// understood; not now, as while the password is closed.
inline constexpr int kTooComplicated = 3;
inline constexpr int kSyntax = 5;
inline constexpr int kNotNow = 7;
inline constexpr int kOtherError = 9;

struct NackRule {
  Outcome outcome = Outcome::refused;
  std::string_view meaning;  ///< with advice
  std::string_view remedy;   ///< for `baudgate status`
  Duration wait{};           ///< before the slave is asked again
  /// The slave may answer for the items one by one although it does not for all of them.
  bool worth_splitting = false;
  /// A single item that is refused so does not exist for us.
  bool missing = false;
  /// The slave looked at the message and judged it; a damaged or crowded-out one it did not.
  bool judged = true;
};

const NackRule& RuleOf(int code);

/// "NACK 6: some of the data does not exist in the device; …".
std::string Explain(int code);

}  // namespace baudgate::protocols::spabus
