// `baudgate decode`: says what captured exchanges mean, with the same rules and codecs as the
// daemon. Reads lines "> hex" (request) and "< hex" (reply, or pieces of it), and what `baudgate
// trace` prints and the flight recorder saves; everything else is a comment. ReadCaptures reads the
// exchanges, and DecodersOf makes decoders.
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

// Decoders for devices of which only the head of a trace and the command line are known. For
// `decode` and `trace`.

/// `head`: comments of the gateway (gateway/records/trace/trace_text.h). A device has none where
/// its profile is a file that is not here.
diagnosis::Decoders DecodersOf(const std::vector<std::string>& head,
                               const config::Catalog& catalog);

struct DecodeOptions {
  std::string protocol{};          ///< empty: as the head of a trace says of each device
  std::string profile{};           ///< empty: likewise; without any, addresses of the protocol
  std::vector<std::string> set{};  ///< device options, "key=value", beside those of the head
  std::string device{};            ///< of a trace, only exchanges with this one; empty: all
  bool prose = false;              ///< for people; else one JSON object a line
  std::size_t width = 0;           ///< of prose, characters a line; 0: no limit
};

/// Each exchange: outcome, reason, values; of a trace also the time and the device. Exit codes: 0
/// done (whatever the outcomes), 2 a line of the input is no hex, or nothing says which protocol it
/// is, 3 no such protocol, profile or option.
int RunDecode(const DecodeOptions& options, const config::Catalog& catalog, std::istream& in,
              std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
