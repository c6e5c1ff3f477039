// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/offline/captures.h"

#include <utility>

#include "gateway/base/text.h"
#include "gateway/decode/trace_line.h"

namespace baudgate {
namespace {

/// An error says what is wrong with this line.
Status TakeLine(std::string_view line, std::vector<Capture>& captures) {
  const TraceLine marked = ReadTraceLine(line);
  const bool of_trace = !marked.time.empty();
  if (of_trace && !captures.empty()) captures.back().last = false;
  // Where a slow reader has lost records, this belongs to another exchange.
  const bool known =
      !captures.empty() && !captures.back().ended && captures.back().device == marked.device;
  if (marked.mark == '=' && of_trace && known) {
    Capture& capture = captures.back();
    capture.told = OutcomeOf(marked.rest);
    capture.why = ReasonOf(marked.rest);
    capture.ended = true;
  }
  if (marked.mark != '>' && marked.mark != '<') return {};
  const auto hex = ParseMaskedHex(marked.rest);
  if (!hex) return Error{"these are not hex bytes"};
  if (marked.mark == '>') {
    Capture capture;
    capture.request = hex->bytes;
    capture.request_masked = hex->masked;
    capture.time = marked.time;
    capture.device = marked.device;
    capture.last = true;
    captures.push_back(std::move(capture));
  } else if (!captures.empty() && !captures.back().ended) {
    captures.back().last = true;
    Append(captures.back().reply, hex->bytes);
    captures.back().reply_masked = captures.back().reply_masked || hex->masked;
  } else if (!of_trace) {  // a trace may begin in the midst of an exchange, and has stray bytes
    return Error{"a reply before any request (\"> hex\")"};
  }
  return {};
}

}  // namespace

Result<Captures> ReadCaptures(std::istream& in) {
  Captures captures;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (auto device = ReadTracedDevice(Trim(line))) captures.devices.push_back(std::move(*device));
    if (const Status taken = TakeLine(line, captures.exchanges); !taken) {
      return Error{"line " + std::to_string(number) + ": " + taken.error()};
    }
  }
  if (in.bad()) return Error{"the captures cannot be read; is this a file?"};
  if (captures.exchanges.empty()) {
    return Error{"no exchange here; write lines \"> hex\" and \"< hex\""};
  }
  return captures;
}

}  // namespace baudgate
