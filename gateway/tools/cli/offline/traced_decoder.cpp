// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/traced_decoder.h"

#include <utility>

#include "gateway/tools/cli/offline/make_line.h"

namespace baudgate {

Result<ExchangeDecoder> MakeDecoder(const TracedDevice& traced, const config::Catalog& catalog) {
  // Requests name their device; this address only has to be a valid one.
  auto line =
      MakeLine({.protocol = traced.protocol,
                .devices = {{.profile = traced.profile, .address = "1", .set = traced.set}}},
               catalog);
  if (!line) return Error{line.error()};
  const Protocol& protocol = *catalog.FindProtocol(line->devices.front().protocol);
  return ExchangeDecoder(std::move(*line), protocol);
}

Decoders DecodersOf(const std::vector<std::string>& head, const config::Catalog& catalog) {
  Decoders decoders;
  for (const std::string& line : head) {
    const auto device = ReadTracedDevice(line);
    if (!device) continue;
    auto decoder = MakeDecoder(*device, catalog);
    if (decoder) decoders.emplace(device->name, std::move(*decoder));
  }
  return decoders;
}

}  // namespace baudgate
