// The contract of frame rules. The bytes of a serial line come in pieces of any size; a frame rule
// finds where a message begins and ends. protocols/assembler.h buffers the bytes and calls the
// rule. docs: protocols/README.md, "The steps". MaskedHex prints a request without its secrets.
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

/// One form that a reply can have. Many requests allow two forms: the value, or a refusal.
struct Shape {
  int tag = 0;  ///< the number by which the protocol's frame rule identifies this form
  std::size_t min_length = 0;  ///< minimum length of the whole frame, in bytes
  std::size_t max_length = 0;

  bool operator==(const Shape&) const = default;
};

/// Base class for data that a frame rule needs in addition to an Expectation. A protocol derives a
/// class from it if its frames are described in a file, as protocols/telegram does.
class FrameForms {
 public:
  virtual ~FrameForms() = default;
};

/// The replies that are expected to one request. Protocol::expect computes it from the request's
/// bytes and the device's options alone. For an empty request, it describes requests instead of
/// replies, for simulated devices and for listeners on a shared bus.
struct Expectation {
  enum class Reply : std::uint8_t {
    none,  ///< the request is a broadcast: the exchange is over when the request was sent
    one,
    /// The device sends messages unasked (Conversation::Listens); the next message answers the
    /// request.
    standing,
  } reply = Reply::one;
  /// The forms of the reply. Empty: every frame that the frame rule accepts is a possible reply.
  std::vector<Shape> shapes{};
  std::size_t max_bytes = 256;  ///< the maximum length of a frame, and of the buffered bytes
  /// The kind of checksum, if the protocol has several kinds. The protocol defines the numbers.
  int checksum = 0;
  /// The bytes of a reply that contain the address of its device. Empty: replies carry no address,
  /// so a late reply could be mistaken for another device's reply. The gateway then waits longer on
  /// the line after a lost reply.
  Bytes address{};
  /// True if the request is allowed to be repeated after a failure: it only reads, or sets
  /// something to a fixed value. False if a repetition does harm: the device counts the requests,
  /// or each request removes another event from it.
  bool repeatable = true;
  /// True if the reply can have the same bytes as its request, as for a Modbus write. On a line
  /// with echo, the echo then looks like the reply.
  bool mirrors = false;
  /// The bytes of the request that no log must show, as pairs of offset and count: passwords, and
  /// check values computed over a password.
  std::vector<std::pair<std::size_t, std::size_t>> secrets{};
  std::shared_ptr<const FrameForms> forms{};

  bool operator==(const Expectation&) const = default;
};

struct Cut {
  enum class Kind : std::uint8_t {
    need_more,  ///< the bytes may still become a frame: keep all
    frame,      ///< the first `size` bytes are a whole frame
    discard,    ///< the first `size` bytes belong to no frame: drop them
  };
  Kind kind = Kind::need_more;
  std::size_t size = 0;  ///< 1 to the number of buffered bytes; 0 for need_more
  /// The kind of the discarded bytes: corrupt, partial (an incomplete frame), unexpected (a whole
  /// frame that answers another request), or none (harmless noise, such as 00 when a driver is
  /// switched on).
  Outcome blame = Outcome::none;
  /// The reason for discarding, for the log: "checksum"; points to static text.
  std::string_view why{};

  static constexpr Cut NeedMore() { return {}; }
  static constexpr Cut Frame(std::size_t size) { return {Kind::frame, size, Outcome::none, {}}; }
  static constexpr Cut Discard(std::size_t size, Outcome blame, std::string_view why) {
    return {Kind::discard, size, blame, why};
  }
};

/// A frame rule examines `held`, the buffered bytes, at least one, from the first byte on. Until it
/// returns need_more, it is called again with the remaining bytes. `idle`: the line is silent, so
/// no more bytes of this frame will come; if the rule still returns need_more, all buffered bytes
/// are dropped as partial.
///
/// A frame rule has no state. tests/laws/frame_rule_laws.h tests every rule for these laws:
/// 1. The same bytes give the same frames, however they are split into pieces.
/// 2. A good frame behind garbage is found. So after damage a rule discards one byte and tries
///    again. It never skips the length that a length field gives: the field may be damaged, and the
///    next good frame would be lost.
/// 3. Every result but need_more takes at least one byte.
///
/// Two rules break law 2 and drop a damaged burst whole, because bytes inside it can look like a
/// frame: the rule for listeners that execute requests from a shared bus, and Modbus TCP, which has
/// no check value (both in protocols/modbus/rules.cpp).
using FrameRule = Cut (*)(View held, const Expectation& expect, bool idle);

/// Returns the request in hex, with `**` in place of secret bytes: "3E 31 57 ** ** 0D". `expect` is
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
