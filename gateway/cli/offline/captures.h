// Exchanges out of the lines of a capture (trace_line.h), and the devices that its head names.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <istream>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/result.h"
#include "gateway/trace/trace_head.h"

namespace baudgate {

struct Capture {
  Bytes request{};
  Bytes reply{};
  bool request_masked = false;
  bool reply_masked = false;
  std::string time{};  ///< of a trace, and so is all below
  std::string device{};
  std::optional<Outcome> told{};  ///< how it ended when it was recorded
  std::string why{};              ///< and the reason that was recorded with it
  bool ended = false;             ///< what comes now belongs to no exchange
  bool last = false;              ///< nothing stands behind it in the recording

  /// More may have come than was recorded.
  bool is_open() const { return !time.empty() && !told; }
};

struct Captures {
  std::vector<TracedDevice> devices;
  std::vector<Capture> exchanges;
};

/// An error names the line that is no hex, or begins with a reply.
Result<Captures> ReadCaptures(std::istream& in);

}  // namespace baudgate
