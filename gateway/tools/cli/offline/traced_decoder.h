// Decoders for devices of which only the head of a trace and the command line are known. For
// `decode` and `trace`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "gateway/base/result.h"
#include "gateway/diagnosis/decode/frame_lines.h"
#include "gateway/records/trace/trace_head.h"

namespace baudgate {

/// The error says what of protocol, profile and options is wrong; the catalog outlives it.
Result<ExchangeDecoder> MakeDecoder(const TracedDevice& traced, const config::Catalog& catalog);

/// `head`: comments of the gateway (gateway/records/trace/trace_head.h). A device has none where
/// its profile is a file that is not here.
Decoders DecodersOf(const std::vector<std::string>& head, const config::Catalog& catalog);

}  // namespace baudgate
