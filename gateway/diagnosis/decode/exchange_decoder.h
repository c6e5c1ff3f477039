// `ExchangeDecoder` returns what recorded exchanges of one device mean, by the rules and codecs of
// the daemon. `decode`, `trace` and the web page use it. `Capture` is one recorded exchange;
// `FrameLines` makes lines of text from the records of a trace.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/model/line.h"
#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "protocols/protocol.h"

namespace baudgate::diagnosis {

// `Capture` is one recorded exchange, the input of ExchangeDecoder.
struct Capture {
  bool unasked = false;  ///< there is no request: a device may have sent the reply unasked
  int line = 0;          ///< number of the line in the recording at which the exchange begins
  Bytes request{};
  Bytes reply{};
  bool request_masked = false;
  bool reply_masked = false;
  /// Time of the exchange. Only a trace sets this and the members below.
  std::string time{};
  Duration heard_at{};  ///< time of day of the latest bytes
  std::string device{};
  std::optional<Outcome> told{};  ///< the recorded outcome
  std::string why{};              ///< the recorded reason of the outcome
  bool ended = false;             ///< the bytes that follow belong to no exchange
  bool last = false;

  /// True if the recording contains no outcome, so more bytes may have come than were recorded.
  bool is_open() const { return !time.empty() && !told; }
};

struct DecodedValue {
  std::string name;  ///< name of the point; without a point, the name in the protocol
  Value value{};
  std::string unit{};
  Quality quality{};
  bool is_point = false;
};

/// Returns the value as text, such as "current_l1 0.5 xIn" or "current_l2 - xIn (bad: not
/// connected)".
std::string ValueText(const DecodedValue& value);

/// The result of decoding an exchange, for example of a trace, or an unasked message.
///  * `outcome` is the outcome in the trace, because an outcome also depends on times. If the trace
///    contains no outcome and no whole frame, `outcome` is `none`: perhaps more bytes came later.
///  * `reason` also names the outcome that the bytes alone lead to, if it is another one.
///  * `values` is empty if the bytes alone lead to another outcome, and if the trace shows bytes of
///    the reply as **.
struct DecodedExchange {
  Outcome outcome = Outcome::none;
  std::string reason;
  std::vector<DecodedValue> values;
};

struct HeardMessage {
  std::size_t end = 0;  ///< index behind the last byte of the message
  DecodedExchange decoded;
};

class ExchangeDecoder {
 public:
  /// `line` must contain exactly one device, with all its options; `protocol` is the protocol of
  /// this device.
  ExchangeDecoder(config::Line line, const protocols::Protocol& protocol);

  DecodedExchange Decode(const Capture& capture);
  /// Returns the index behind the first whole frame of the reply; without a frame, the size of the
  /// reply.
  std::size_t FirstFrame(const Capture& capture) const;

  bool Listens() const { return conversation_->Listens() != nullptr; }
  /// Returns the messages in these bytes. Bytes that belong to no message are returned as a damaged
  /// message before the next message, or at the end.
  std::vector<HeardMessage> Hear(View bytes);

 private:
  DecodedExchange ToExchange(protocols::Answer answer) const;

  std::unique_ptr<config::Line> line_;  // contains the one device; must not move
  const protocols::Protocol* protocol_;
  std::unique_ptr<protocols::Bus> bus_;
  protocols::ParsedOptions options_;
  std::unique_ptr<protocols::Conversation> conversation_;
};

// `FrameLines` converts the records of a trace to one line for each frame: it joins the pieces of a
// frame, and appends the meaning of a reply if its device has a decoder. It has no I/O. Example of
// its lines:
//
//   12:23:31.717352 feeder-1 > 3E 31 52 49 31 3A 43 43 0D | >1RI1:CC.
//   12:23:31.735202 feeder-1 < 0A 3C 31 44 3A … 0D 0A | current_l1 0.52 xIn
//   12:23:31.774724 feeder-1 = ok, 57.4 ms
//   12:23:32.000000 - < 41 42 | AB
//   12:23:33.000000 feeder-2 = no_reply: no reply after 500 ms
//
// `decode` can read these lines as well as the records. ReadTraceLine reads one line of a capture.

// The form of a line of a capture, as `trace` prints it, the flight recorder saves it, or a user
// writes it:
//
//   > 3E 31 52 49
//   04:05:06.143210 feeder-1 < 3C 31 44 3A | <1D:
//   04:05:06.143300 feeder-1 = corrupt, 19.8 ms: checksum

/// The parts of one line of a capture. The views refer to the line. Only lines of a trace contain
/// time and device.
struct TraceLine {
  char mark = 0;
  std::string_view rest;  ///< the text behind the mark, up to '|'
  std::string_view time;
  std::string_view device;
  std::string_view shown;  ///< the text behind '|'
};
TraceLine ReadTraceLine(std::string_view line);

/// Bytes that come unasked belong to a new message if they come later than this after the bytes
/// before.
inline constexpr Duration kApart = 50ms;
/// Returns the time since midnight of a text such as "04:05:06.123456"; zero: the text is not a
/// time.
Duration TimeOfDay(std::string_view clock);
/// Returns the time from `from` to `to`, which are times of day; `to` may be after midnight.
Duration Between(Duration from, Duration to);

struct ParsedHex {
  Bytes bytes;
  bool masked = false;  ///< some bytes were "**" and were replaced by another byte
};
/// Parses text such as "3E 31 ** 0D"; nothing: the text is not hexadecimal.
std::optional<ParsedHex> ParseMaskedHex(std::string_view text);

/// Returns the outcome in the text after "=", such as "corrupt, 27.3 ms: checksum".
std::optional<Outcome> OutcomeOf(std::string_view end);
/// Returns the text after the colon, such as "checksum"; empty: there is no text.
std::string_view ReasonOf(std::string_view end);

using Decoders = std::map<std::string, ExchangeDecoder>;
using ProtocolFinder = std::function<const protocols::Protocol*(const std::string&)>;
/// Returns decoders for all devices of the line, or only for the device named `only`. A device
/// whose protocol `find` does not know gets no decoder.
Decoders DecodersOf(const config::Line& line, const ProtocolFinder& find,
                    const std::string& only = "");

class FrameLines {
 public:
  /// More bytes than this are not joined to a frame; they are printed in several lines.
  static constexpr std::size_t kMostBytes = 8192;

  /// Bytes of a device that is not in `decoders` are printed without their meaning.
  explicit FrameLines(Decoders decoders) : decoders_(std::move(decoders)) {}

  /// Takes a record and returns the lines that are complete with it.
  std::vector<std::string> Take(const std::string& record);
  /// True if unasked bytes are stored that may be incomplete. Call Flush after a pause, because no
  /// end of an exchange follows.
  bool waits() const { return !exchange_ && !held_.reply.empty(); }
  /// Returns the stored bytes as lines. Call at the end, or after a pause.
  std::vector<std::string> Flush();

 private:
  /// Received bytes that are not printed yet.
  struct Held {
    std::string time;
    std::string device;
    std::string shown;
    Bytes reply;
    std::vector<bool> masked;
    Duration last{};  ///< time of day of the latest byte
  };

  void Hold(const TraceLine& piece);
  void End(const TraceLine& end, const std::string& record, std::vector<std::string>& lines);
  bool FlushMessages(const Held& held, std::vector<std::string>& lines);
  static void AddLine(const Held& held, std::size_t from, std::size_t to,
                      const std::string& meaning, std::vector<std::string>& lines);
  void FlushHeld(const std::string& meaning, std::size_t first_frame,
                 std::vector<std::string>& lines);

  Decoders decoders_;
  std::optional<Capture> exchange_;  // empty: no exchange is under way
  Duration asked_{};                 // time of day of the request
  Held held_;
};

}  // namespace baudgate::diagnosis
