// `baudgate decode`: decodes captured exchanges with the rules and codecs of the daemon. It reads
// lines "> hex" (request) and "< hex" (a reply or a part of a reply), the output of `baudgate
// trace`, and the content of the flight recorder; other lines are comments.
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

/// Makes decoders from the comment lines at the head of a trace
/// (gateway/records/trace/trace_text.h). A device gets no decoder if its profile is a file that
/// does not exist on this machine.
diagnosis::Decoders DecodersOf(const std::vector<std::string>& head,
                               const config::Catalog& catalog);

struct DecodeOptions {
  std::string protocol{};  ///< empty: the protocol of each device in the head of the trace
  /// The profile; empty: the profile of each device in the head of the trace. Without a profile,
  /// values are named by address.
  std::string profile{};
  /// Device options, "key=value", in addition to the options in the head of the trace.
  std::vector<std::string> set{};
  std::string device{};   ///< decode only exchanges with this device; empty: all exchanges
  bool prose = false;     ///< true: readable text; false: one JSON object per line
  std::size_t width = 0;  ///< width of readable text, in characters per line; 0: no limit
};

/// Exit codes: 0 decoded, whatever the outcomes of the exchanges; 2 an input line is not hex, or no
/// protocol is given; 3 unknown protocol, profile or option.
int RunDecode(const DecodeOptions& options, const config::Catalog& catalog, std::istream& in,
              std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
