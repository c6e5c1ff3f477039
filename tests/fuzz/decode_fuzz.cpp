// Fuzzes `baudgate decode`. Input: a byte for the protocol, then the text of a capture file.
// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>
#include <sstream>

#include "gateway/tools/cli/offline/decode.h"
#include "protocols/all_protocols.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/target.h"

namespace baudgate::fuzz {
namespace {

void FuzzDecode(View bytes) {
  static const config::Catalog catalog = [] {
    config::Catalog all;
    for (const protocols::Protocol* protocol : protocols::AllProtocols())
      all.protocols.emplace(protocol->name, protocol);
    return all;
  }();
  Input input(bytes);
  tools::DecodeOptions options;
  options.protocol = protocols::AllProtocols()[input.Below(protocols::AllProtocols().size())]->name;
  std::istringstream in{std::string(AsText(input.Rest()))};
  std::ostringstream out;
  std::ostringstream err;
  const int code = RunDecode(options, catalog, in, out, err);
  Require(code == 0 || code == 2, "captures are decoded or refused");
  Require((code == 0) == err.str().empty(), "a refusal has words");
  std::istringstream lines(out.str());
  for (std::string line; std::getline(lines, line);) {
    const auto object = nlohmann::json::parse(line, nullptr, false);
    Require(object.is_object() && object.contains("outcome"), "one JSON object a line");
  }
}

const Registered kDecode("decode", FuzzDecode);

}  // namespace
}  // namespace baudgate::fuzz
