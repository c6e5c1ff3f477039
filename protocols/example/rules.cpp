// SPDX-License-Identifier: Apache-2.0
#include "protocols/example/rules.h"

#include <algorithm>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "protocols/common/frame_cuts.h"
#include "protocols/example/codec.h"

namespace baudgate::protocols::example {

Expectation Expect(View request) {
  Expectation expect{.max_bytes = kMaxFrame};
  if (const auto message = Decode(request)) {
    expect.address = {static_cast<std::uint8_t>(message->device)};
  }
  return expect;
}

namespace {

Cut CutLine(View held, std::string_view starts, bool idle) {
  if (starts.find(static_cast<char>(held[0])) == std::string_view::npos) {
    return cut::SkipNoise(held, starts);
  }
  const auto end = std::find(held.begin(), held.end(), '\r');
  const auto size = static_cast<std::size_t>(end - held.begin()) + 1;
  if (end != held.end() && size <= kMaxFrame) return Cut::Frame(size);
  return held.size() >= kMaxFrame ? cut::TooLong() : cut::Wait(idle);
}

}  // namespace

Cut RequestRule(View held, const Expectation&, bool idle) { return CutLine(held, "?W", idle); }

Cut ReplyRule(View held, const Expectation&, bool idle) {
  const Cut line = CutLine(held, "!", idle);
  if (line.kind != Cut::Kind::frame) return line;
  if (line.size < 5) return cut::BadChecksum();
  const View body = held.first(line.size - 4);  // the frame without '*', two checksum digits and CR
  const std::string sum = "*" + HexByte(Sum8(body));
  return AsText(held.subspan(body.size(), 3)) == sum ? line : cut::BadChecksum();
}

}  // namespace baudgate::protocols::example
