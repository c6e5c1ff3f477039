// The contract of frame rules. Bytes come from a serial line in pieces of any size; a frame rule
// finds where a message begins and ends. protocols/assembler.h buffers the bytes and calls the
// rule. docs: protocols/README.md, "The steps". MaskedHex prints a request without its secrets.
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

/// One form that a reply may have. A request often allows two: the value, or a refusal.
struct Shape {
  int tag = 0;  ///< the number by which the protocol's frame rule identifies this form
  std::size_t min_length = 0;  ///< length of the whole frame in bytes
  std::size_t max_length = 0;

  bool operator==(const Shape&) const = default;
};

/// Data that a frame rule needs beyond an Expectation, for protocols whose frames are described in
/// a file. A protocol derives a class from FrameForms if it needs one; most do not.
class FrameForms {
 public:
  virtual ~FrameForms() = default;
};

/// The replies that are expected to one request. Protocol::expect derives it from the request's
/// bytes and the device's options alone. For an empty request it describes requests, for listeners
/// on a shared bus.
struct Expectation {
  enum class Reply : std::uint8_t {
    none,  ///< a broadcast: the exchange is over once the request is sent
    one,
    standing,  ///< messages that the device sends unasked (Conversation::Listens); the next message
               ///< answers a request with this expectation
  } reply = Reply::one;
  std::vector<Shape> shapes{};  ///< empty: every frame that the rule accepts
  std::size_t max_bytes = 256;  ///< the maximum length of a frame, and of the buffered bytes
  /// The kind of checksum, if the protocol has several; the protocol numbers them.
  int checksum = 0;
  /// The bytes of a reply that name its device. Empty: replies carry no address, so a late reply
  /// could be mistaken for another device's. The line then stays silent longer after a lost reply.
  Bytes address{};
  /// True if the request may be repeated after a failure, because it only reads, or sets something
  /// to a value. False if a repetition does harm: it is counted, or it removes another event from
  /// the device.
  bool repeatable = true;
  /// True if a reply may have the same bytes as its request, for example to a Modbus write. On a
  /// line with echo, the echo then looks like the reply.
  bool mirrors = false;
  /// Bytes of the request that no log may show, each as offset and count: passwords, and check
  /// values computed over a password.
  std::vector<std::pair<std::size_t, std::size_t>> secrets{};
  std::shared_ptr<const FrameForms> forms{};

  bool operator==(const Expectation&) const = default;
};

/// The decision of a frame rule about the buffered bytes.
struct Cut {
  enum class Kind : std::uint8_t {
    need_more,  ///< the bytes may still become a frame: keep all
    frame,      ///< the first `size` bytes are a whole frame
    discard,    ///< the first `size` bytes belong to no frame: drop them
  };
  Kind kind = Kind::need_more;
  std::size_t size = 0;  ///< from 1 to the number of buffered bytes; 0 only with need_more
  /// The kind of the discarded bytes: corrupt, partial (an incomplete frame), none (harmless noise,
  /// such as 00 when a driver is switched on), or unexpected (a whole frame that answers another
  /// request).
  Outcome blame = Outcome::none;
  std::string_view why{};  ///< the reason for the log: "checksum". Static text

  static constexpr Cut NeedMore() { return {}; }
  static constexpr Cut Frame(std::size_t size) { return {Kind::frame, size, Outcome::none, {}}; }
  static constexpr Cut Discard(std::size_t size, Outcome blame, std::string_view why) {
    return {Kind::discard, size, blame, why};
  }
};

/// A frame rule examines the front of `held`, the buffered bytes, at least one. It is called again
/// with the rest until it returns need_more. `idle`: the line is silent, so no more bytes of this
/// frame will come; on need_more all buffered bytes are then dropped as partial.
///
/// A frame rule is a pure function. tests/laws/frame_rule_laws.h tests every rule for these laws:
/// 1. The same bytes give the same frames, however they are split into pieces.
/// 2. A good frame behind garbage is found. After damage a rule therefore discards one byte and
/// tries again. It never skips the length that a length field gives: the field may be damaged, and
/// the next good frame would be lost.
/// 3. Every result but need_more takes at least one byte.
///
/// Two rules break law 2 and drop a damaged burst whole, because bytes inside it may look like a
/// frame: the rule for listeners that execute requests from a shared bus, and Modbus TCP, which has
/// no check value (both in protocols/modbus/rules.cpp).
using FrameRule = Cut (*)(View held, const Expectation& expect, bool idle);

/// Returns the request in hex with `**` in place of secret bytes: "3E 31 57 ** ** 0D". `expect` is
/// the Expectation of this request.
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
