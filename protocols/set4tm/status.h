// What the one-byte status of a SET-4TM means for the exchange, the points and the next request.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/outcome.h"
#include "gateway/base/quality.h"
#include "gateway/base/time.h"

namespace baudgate::protocols::set4tm {

/// Low nibbles of the status byte (reference, chapter 6).
enum StatusCode : std::uint8_t {
  kOk = 0x0,
  kNotAllowed = 0x1,
  kInternalError = 0x2,
  kLevelTooLow = 0x3,
  kClockAlreadyCorrected = 0x4,
  kChannelClosed = 0x5,
  kRepeat = 0x6,
  kNotReady = 0x7,
  kBusy = 0x8,
  kMeterSilent = 0xF,
};

constexpr std::uint8_t CodeOf(std::uint8_t status) { return status & 0x0FU; }

struct StatusMeaning {
  Outcome outcome = Outcome::ok;
  std::string reason;              ///< empty when ok
  std::optional<Quality> quality;  ///< of the points that were asked for
  Duration wait{};                 ///< seconds of the high nibble, or our own patience
  std::string_view remedy{};       ///< for `baudgate status`
};

/// `opening`: the status answers a request to open the channel, where 3 means the password.
StatusMeaning Explain(std::uint8_t status, bool opening);

}  // namespace baudgate::protocols::set4tm
