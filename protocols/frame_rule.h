// The contract of frame rules. Bytes come from a serial line in pieces of any size; a frame rule
// says where a message begins and where it ends. protocols/assembler.h keeps the bytes and calls
// it. docs: protocols/README.md, "Frame rules". MaskedHex shows a request without its secrets.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/text.h"

namespace baudgate::protocols {

/// One form that a reply may have. A request often has two: the value, or a refusal.
struct Shape {
  int tag = 0;                 ///< the protocol's own number of this form, for its frame rule
  std::size_t min_length = 0;  ///< of the whole frame, bytes
  std::size_t max_length = 0;

  bool operator==(const Shape&) const = default;
};

/// What a frame rule needs beyond an Expectation, if the frames of a protocol are described in a
/// file. A protocol derives its own; most need none.
class FrameForms {
 public:
  virtual ~FrameForms() = default;
};

/// What may answer one request. A pure function of the request's bytes and the device's options
/// (Protocol::expect). For an empty request it describes requests, for listeners on a shared bus.
struct Expectation {
  enum class Reply : std::uint8_t {
    none,  ///< a broadcast: the exchange is over once the request is sent
    one,
    standing,  ///< messages that the device sends unasked (Conversation::Listens); the next of them
               ///< answers a request with this expectation
  } reply = Reply::one;
  std::vector<Shape> shapes{};  ///< empty: every frame that the rule takes for whole
  std::size_t max_bytes = 256;  ///< no frame is longer; no more bytes are ever kept
  int checksum = 0;  ///< the kind of checksum, if a protocol has several; its own numbers
  /// The bytes by which a reply names its device, as they are in the frame. Empty: replies carry no
  /// address, so a late one could be taken for another device's. The line then stays silent longer
  /// after a lost reply.
  Bytes address{};
  /// After a failure the same request may be sent once more: it reads, or it sets something to a
  /// value. False if a second request does harm: a counter that counts requests, an event that is
  /// taken out of the device.
  bool repeatable = true;
  /// A reply may have the same bytes as its request, for example to a Modbus write. On a line that
  /// echoes what is sent, the echo then looks like the reply.
  bool mirrors = false;
  /// Bytes of the request that no log may show, each as offset and count: passwords, and the check
  /// value over one.
  std::vector<std::pair<std::size_t, std::size_t>> secrets{};
  std::shared_ptr<const FrameForms> forms{};

  bool operator==(const Expectation&) const = default;
};

/// The answer of a frame rule to the bytes kept so far.
struct Cut {
  enum class Kind : std::uint8_t {
    need_more,  ///< they may become a frame: nothing is taken yet
    frame,      ///< the first `size` bytes are a whole frame
    discard,    ///< the first `size` bytes belong to no frame, and are dropped
  };
  Kind kind = Kind::need_more;
  std::size_t size = 0;  ///< 1 to all bytes kept; 0 only with need_more
  /// What discarded bytes were: corrupt, partial (a frame that broke off), none (noise that does no
  /// harm, such as 00 when a driver is switched on), or unexpected (a whole frame that answers
  /// another request).
  Outcome blame = Outcome::none;
  std::string_view why{};  ///< why bytes were discarded, for the log: "checksum". Static text

  static constexpr Cut NeedMore() { return {}; }
  static constexpr Cut Frame(std::size_t size) { return {Kind::frame, size, Outcome::none, {}}; }
  static constexpr Cut Discard(std::size_t size, Outcome blame, std::string_view why) {
    return {Kind::discard, size, blame, why};
  }
};

/// Looks at the front of `held`, the bytes kept, of which there is at least one. It is called again
/// with what is left until it says need_more. `idle`: the line is silent, so nothing more will come
/// for these bytes; need_more then means that they are dropped as partial.
///
/// A frame rule is a pure function. tests/laws/frame_rule_laws.h holds every rule to these laws:
/// 1. The same bytes give the same frames, however they are cut into pieces.
/// 2. A good frame behind garbage is found. After damage a rule therefore discards one byte and
///    looks again. It never skips as many bytes as a length field says: the length may be damaged,
///    and the next good frame would be lost with it.
/// 3. Every answer but need_more takes at least one byte.
///
/// Two drop a damaged burst whole instead of 2, as bytes inside it may look like a frame: listeners
/// that carry out what they hear on a shared bus, and Modbus TCP, which has no check value (both in
/// protocols/modbus/rules.cpp).
using FrameRule = Cut (*)(View held, const Expectation& expect, bool idle);

// A request as users may see it: in hex, with `**` in place of secret bytes.

/// `expect`: of this request. "3E 31 57 ** ** 0D".
inline std::string MaskedHex(View request, const Expectation& expect) {
  std::string text;
  for (std::size_t i = 0; i < request.size(); ++i) {
    const bool secret = std::ranges::any_of(expect.secrets, [i](const auto& range) {
      return i >= range.first && i - range.first < range.second;
    });
    text += (text.empty() ? "" : " ") + (secret ? std::string("**") : HexByte(request[i]));
  }
  return text;
}

}  // namespace baudgate::protocols
