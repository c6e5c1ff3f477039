// Exchanges out of the lines of a capture (gateway/diagnosis/decode/trace_line.h), and the devices
// that its head names.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <istream>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/diagnosis/decode/capture.h"
#include "gateway/records/trace/trace_head.h"

namespace baudgate {

struct Captures {
  std::vector<TracedDevice> devices;
  std::vector<Capture> exchanges;
};

/// An error names the line that is no hex.
Result<Captures> ReadCaptures(std::istream& in);

}  // namespace baudgate
