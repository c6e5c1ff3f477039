// The contract of frame rules: where a protocol's messages begin and end in a stream of bytes.
// A rule is a stateless, pure function; gateway/line/assembler.h does the buffering around it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"

namespace baudgate {

/// One form that a reply may have. What `tag` means is the protocol's own affair (a reply type, a
/// leading character); lengths are those of the whole frame.
struct Shape {
  int tag = 0;
  std::size_t min_length = 0;
  std::size_t max_length = 0;
};

/// What may answer one request: a pure function of the request's bytes and the device's options.
/// With no request (see Protocol::expect) it describes requests, for twins and listening sides.
struct Expectation {
  enum class Reply : std::uint8_t { none, one } reply = Reply::one;
  std::vector<Shape> shapes;    ///< empty = whatever the rule takes for whole
  std::size_t max_bytes = 256;  ///< a frame is never longer; bounds every buffer
  int checksum = 0;             ///< the protocol's own variant number
  /// As it stands at the head of the reply. Empty: the reply can not be told from another device's,
  /// and the poller waits longer after a lost one.
  Bytes address;
  bool repeatable = true;  ///< may be sent again after a failure
  bool mirrors = false;    ///< a good reply equals its request, so that an echo looks like one
  /// Bytes of the request that no log may show: offset and count. Check values over a secret are
  /// secret as well.
  std::vector<std::pair<std::size_t, std::size_t>> secrets;
};

/// A rule's answer about the bytes held so far. Never more than `held.size()` bytes are consumed.
struct Cut {
  enum class Kind : std::uint8_t { need_more, frame, discard };
  Kind kind = Kind::need_more;
  std::size_t size = 0;  ///< of the frame, or how many bytes to discard (at least 1)
  /// Of a discard: corrupt, partial, none for harmless noise; unexpected for a whole frame that is
  /// not the awaited one, which may stand behind it.
  Outcome blame = Outcome::none;
  std::string_view why;  ///< of a discard, static text: "checksum", "noise before frame"

  static constexpr Cut NeedMore() { return {}; }
  static constexpr Cut Frame(std::size_t size) { return {Kind::frame, size, Outcome::none, {}}; }
  static constexpr Cut Discard(std::size_t size, Outcome blame, std::string_view why) {
    return {Kind::discard, size, blame, why};
  }
};

/// `held` is never empty. `idle`: the line has fallen silent, nothing more will come for now; a
/// rule that answers need_more even so leaves its bytes to be dropped as partial.
///
/// Laws, held by tests/laws: any fragmentation gives the same frames; after garbage a good frame is
/// delivered; every answer but need_more consumes; the same slice gets the same answer. After
/// damage discard one byte and look again, unless the boundary can not be forged: a length that has
/// not been verified is never trusted. Only who carries out what he hears between others looks
/// again at the next silence: what lies inside damage may be anything (rtu_frame_rule.cpp).
using FrameRule = Cut (*)(View held, const Expectation& expect, bool idle);

}  // namespace baudgate
