// `baudgate decode`: decodes captured exchanges with the rules and codecs of the daemon. Reads
// lines "> hex" (request) and "< hex" (reply or a part of it), and the formats of `baudgate trace`
// and the flight recorder; other lines are comments.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <istream>
#include <ostream>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "gateway/base/result.h"
#include "gateway/diagnosis/decode/exchange_decoder.h"
#include "gateway/records/trace/trace_text.h"

namespace baudgate::tools {

/// Makes decoders from the head of a trace, which consists of comment lines
/// (gateway/records/trace/trace_text.h). A device gets no decoder if its profile is a file that is
/// missing here.
diagnosis::Decoders DecodersOf(const std::vector<std::string>& head,
                               const config::Catalog& catalog);

struct DecodeOptions {
  std::string protocol{};  ///< empty: each device's protocol in the head of the trace
  /// The profile; empty: each device's profile in the head; without any, values are named by
  /// address.
  std::string profile{};
  /// Device options, "key=value", in addition to those of the head.
  std::vector<std::string> set{};
  std::string device{};   ///< of a trace: only exchanges with this device; empty: all
  bool prose = false;     ///< readable text; false: one JSON object per line
  std::size_t width = 0;  ///< of prose, in characters per line; 0: no limit
};

/// Exit codes: 0 done, whatever the outcomes; 2 an input line is no hex, or no protocol is given; 3
/// unknown protocol, profile or option.
int RunDecode(const DecodeOptions& options, const config::Catalog& catalog, std::istream& in,
              std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
