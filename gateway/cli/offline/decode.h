// `baudgate decode`: says what captured exchanges mean, with the same rules and codecs as the
// daemon. Reads lines "> hex" (request) and "< hex" (reply, or pieces of it), and what `baudgate
// trace` prints and the flight recorder saves; everything else is a comment.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <istream>
#include <ostream>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"

namespace baudgate {

struct DecodeOptions {
  std::string protocol;
  std::string profile;           ///< empty: values carry the protocol's own addresses
  std::vector<std::string> set;  ///< device options, "key=value"
  std::string device;            ///< of a trace, only exchanges with this one; empty: all
};

/// One JSON object a line for each exchange: outcome, reason, values; of a trace also the time and
/// the device. Where a trace tells how an exchange ended, that is its outcome: times decide, too.
/// The reason says what the bytes alone would be where that differs, and there are no values then.
/// Where a trace does not tell it and no whole frame came, the outcome is `none`: more may have
/// come than was recorded. Bytes that a trace shows as ** are unknown, and there are no values that
/// would need them. Exit codes: 0 done (whatever the outcomes), 2 a line of the input is no hex, 3
/// no such protocol, profile or option.
int RunDecode(const DecodeOptions& options, const config::Catalog& catalog, std::istream& in,
              std::ostream& out, std::ostream& err);

}  // namespace baudgate
