// One exchange as it was recorded: for gateway/diagnosis/decode/exchange_decoder.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"

namespace baudgate {

struct Capture {
  bool unasked = false;  ///< there is no request: a device may have sent it by itself
  int line = 0;          ///< of the recording, where it begins
  Bytes request{};
  Bytes reply{};
  bool request_masked = false;
  bool reply_masked = false;
  std::string time{};   ///< of a trace, and so is all below
  Duration heard_at{};  ///< of the day, its newest bytes
  std::string device{};
  std::optional<Outcome> told{};  ///< how it ended when it was recorded
  std::string why{};              ///< and the reason that was recorded with it
  bool ended = false;             ///< what comes now belongs to no exchange
  bool last = false;              ///< nothing follows it in the recording

  /// More may have come than was recorded.
  bool is_open() const { return !time.empty() && !told; }
};

}  // namespace baudgate
