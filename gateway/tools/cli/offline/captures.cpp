// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/captures.h"

#include <utility>

#include "gateway/base/text.h"
#include "gateway/diagnosis/decode/trace_line.h"

namespace baudgate {
namespace {

/// A message that came unasked ends with a silence.
bool Continues(const Capture& capture, const TraceLine& piece) {
  if (!capture.unasked || piece.time.empty()) return true;
  return Between(capture.heard_at, TimeOfDay(piece.time)) <= kApart;
}

/// A request that was sent; its reply follows.
Capture Begun(const TraceLine& marked, int number, const MaskedHex& hex) {
  Capture capture;
  capture.line = number;
  capture.request = hex.bytes;
  capture.request_masked = hex.masked;
  capture.time = marked.time;
  capture.device = marked.device;
  capture.last = true;
  return capture;
}

/// Bytes that came unasked.
Capture Heard(const TraceLine& marked, int number, const MaskedHex& hex) {
  return {.unasked = true,
          .line = number,
          .reply = hex.bytes,
          .reply_masked = hex.masked,
          .time = std::string(marked.time),
          .heard_at = TimeOfDay(marked.time),
          .device = std::string(marked.device),
          .last = true};
}

/// An error says what is wrong with this line.
Status TakeLine(std::string_view line, int number, std::vector<Capture>& captures) {
  const TraceLine marked = ReadTraceLine(line);
  const bool of_trace = !marked.time.empty();
  if (of_trace && !captures.empty()) captures.back().last = false;
  if (marked.mark != '<' && !captures.empty() && captures.back().unasked) {
    captures.back().ended = true;
  }
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
  const bool continues =
      !captures.empty() && !captures.back().ended && Continues(captures.back(), marked);
  if (marked.mark == '>') {
    captures.push_back(Begun(marked, number, *hex));
  } else if (continues) {
    captures.back().last = true;
    captures.back().heard_at = TimeOfDay(marked.time);
    Append(captures.back().reply, hex->bytes);
    captures.back().reply_masked = captures.back().reply_masked || hex->masked;
  } else {
    captures.push_back(Heard(marked, number, *hex));
  }
  return {};
}

}  // namespace

Result<Captures> ReadCaptures(std::istream& in) {
  Captures captures;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (auto device = ReadTracedDevice(Trim(line))) captures.devices.push_back(std::move(*device));
    if (const Status taken = TakeLine(line, number, captures.exchanges); !taken) {
      return Error{"line " + std::to_string(number) + ": " + taken.error()};
    }
  }
  if (in.bad()) return Error{"the captures cannot be read; is this a file?"};
  return captures;
}

}  // namespace baudgate
