// Cuts lines from ':' to CR LF whose LRC is right.
//
//   > 3A 31 34 30 33 30 31 46 34 30 30 30 31 46 33 0D 0A   :140301F40001F3 CR LF
//                                                          read holding 500 of slave 20
//   < 3A 31 34 30 33 30 32 30 30 33 31 42 36 0D 0A         :1403020031B6 CR LF       0031
//   < 3A 31 34 38 33 30 32 36 37 0D 0A                     :14830267 CR LF           exception 02
//
// Hex digits may be of either case. The line feed may be missing: the next character or silence
// shows it. A second ':' means that the first line was cut off.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/ascii_frame_rule.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/common/frame_cuts.h"
#include "protocols/modbus/codec.h"
#include "protocols/modbus/pdu.h"

namespace baudgate::protocols::modbus {
namespace {

/// A whole line with a good LRC, from ':' to CR or LF.
Cut CutLine(View held, const Expectation& expect, bool idle) {
  if (held.front() != ':') return cut::SkipNoise(held, ":", "\r\n");
  const auto stop = std::find_if_not(held.begin() + 1, held.end(), [](std::uint8_t byte) {
    return HexDigit(static_cast<char>(byte)).has_value();
  });
  const auto end = static_cast<std::size_t>(stop - held.begin());
  const bool line_feed_missing = end + 1 == held.size();
  if (end + 2 > expect.max_bytes) {
    return cut::TooLong();
  }
  if (stop == held.end()) {
    return cut::Wait(idle, end);
  }
  if (*stop == ':') return Cut::Discard(end, Outcome::partial, "another frame begins");
  if (*stop != '\r') return Cut::Discard(end + 1, Outcome::corrupt, "not a hex digit");
  if (line_feed_missing && !idle) return Cut::NeedMore();
  const std::size_t size = !line_feed_missing && held[end + 1] == '\n' ? end + 2 : end + 1;
  if (!Unwrap(Framing::ascii, held.first(size))) {
    return cut::BadChecksum(size);
  }
  return Cut::Frame(size);
}

}  // namespace

Cut AsciiRequestRule(View held, const Expectation& expect, bool idle) {
  return CutLine(held, expect, idle);
}

Cut AsciiReplyRule(View held, const Expectation& expect, bool idle) {
  const Cut line = CutLine(held, expect, idle);
  if (line.kind != Cut::Kind::frame || expect.shapes.empty()) return line;
  const auto adu = Unwrap(Framing::ascii, held.first(line.size));
  if (!expect.address.empty() && adu->slave != expect.address[0]) {
    return cut::OfAnother(line.size);
  }
  const std::size_t length = FrameLength(Framing::ascii, adu->pdu.size());
  const auto shape = std::ranges::find(expect.shapes, adu->pdu[0], &Shape::tag);
  const bool asked = shape != expect.shapes.end();
  const bool fits = asked && length >= shape->min_length && length <= shape->max_length;
  if (fits || IsReplyForm(adu->pdu)) return line;
  // Some devices confirm functions 15 and 16 with the whole request; see rtu_frame_rule.cpp.
  const bool whole_write = asked && IsMultipleWrite(adu->pdu[0]) && IsCommon(adu->pdu);
  if (whole_write && held.size() == line.size) return idle ? line : Cut::NeedMore();
  return Cut::Discard(line.size, Outcome::partial, "not a reply to what was asked");
}

}  // namespace baudgate::protocols::modbus
