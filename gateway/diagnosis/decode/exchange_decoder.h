// ExchangeDecoder returns what the exchanges of one device mean, with the rules and codecs of the
// daemon, for `decode`, `trace` and the web page. Capture is one recorded exchange; FrameLines
// makes lines of the records of a trace.
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

// Input of ExchangeDecoder: one recorded exchange.
struct Capture {
  bool unasked = false;  ///< there is no request: a device may have sent the reply unasked
  int line = 0;          ///< the line of the recording on which the exchange begins
  Bytes request{};
  Bytes reply{};
  bool request_masked = false;
  bool reply_masked = false;
  std::string time{};   ///< only in a trace, as all members below
  Duration heard_at{};  ///< time of day of the newest bytes
  std::string device{};
  std::optional<Outcome> told{};  ///< the outcome that was recorded
  std::string why{};              ///< the reason that was recorded with the outcome
  bool ended = false;             ///< the following bytes belong to no exchange
  bool last = false;              ///< nothing follows in the recording

  /// True if more bytes may have come than were recorded.
  bool is_open() const { return !time.empty() && !told; }
};

struct DecodedValue {
  std::string name;  ///< name of the point, or without a point the name in the protocol
  Value value{};
  std::string unit{};
  Quality quality{};
  bool is_point = false;
};

/// The value as text: "current_l1 0.5 xIn", "current_l2 - xIn (bad: not connected)".
std::string ValueText(const DecodedValue& value);

/// The result of decoding. If a trace contains an outcome, that is the outcome, because times
/// matter too; if the bytes alone give a different outcome, `reason` contains it and there are no
/// values. If the trace contains no outcome and no whole frame came, the outcome is `none`, because
/// more bytes may have come than were recorded. Bytes that a trace shows as ** are unknown, so
/// values that need them are missing.
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
  /// `line` must contain exactly this device, with all its options. `protocol` is the protocol of
  /// the device.
  ExchangeDecoder(config::Line line, const protocols::Protocol& protocol);

  DecodedExchange Decode(const Capture& capture);
  /// The index behind the first whole frame of the reply; the size of the reply if there is none.
  std::size_t FirstFrame(const Capture& capture) const;

  /// True if the device sends unasked.
  bool Listens() const { return conversation_->Listens() != nullptr; }
  /// Returns the messages in these bytes. Bytes that are not a message are reported before the next
  /// message, or at the end.
  std::vector<HeardMessage> Hear(View bytes);

 private:
  DecodedExchange ToExchange(protocols::Answer answer) const;

  std::unique_ptr<config::Line> line_;  // contains the one device, which must not move
  const protocols::Protocol* protocol_;
  std::unique_ptr<protocols::Bus> bus_;
  protocols::ParsedOptions options_;
  std::unique_ptr<protocols::Conversation> conversation_;
};

// FrameLines turns the records of a trace into one line for each frame: the pieces of a frame are
// put together, and the meaning of a reply follows if its device has a decoder. Pure: text in, text
// out.
//
//   12:23:31.717352 feeder-1 > 3E 31 52 49 31 3A 43 43 0D | >1RI1:CC.
//   12:23:31.735202 feeder-1 < 0A 3C 31 44 3A … 0D 0A | current_l1 0.52 xIn
//   12:23:31.774724 feeder-1 = ok, 57.4 ms
//   12:23:32.000000 - < 41 42 | AB
//   12:23:33.000000 feeder-2 = no_reply: no reply after 500 ms
//
// `decode` reads these lines as it reads the records. ReadTraceLine reads one line of a capture.

// A line of a capture, as `trace` prints it, the flight recorder saves it, or a user writes it:
//
//   > 3E 31 52 49
//   04:05:06.143210 feeder-1 < 3C 31 44 3A | <1D:
//   04:05:06.143300 feeder-1 = corrupt, 19.8 ms: checksum

/// The parts of one line; the views refer to the line. A line of a trace also contains time and
/// device.
struct TraceLine {
  char mark = 0;
  std::string_view rest;  ///< the text behind the mark, without the characters behind '|'
  std::string_view time;
  std::string_view device;
  std::string_view shown;  ///< the characters behind '|'
};
TraceLine ReadTraceLine(std::string_view line);

/// Unasked bytes that come later than this after the bytes before belong to a new message.
inline constexpr Duration kApart = 50ms;
/// The time since midnight of "04:05:06.123456"; zero: the text is not a time.
Duration TimeOfDay(std::string_view clock);
/// The time from one time of day to the next, also over midnight.
Duration Between(Duration from, Duration to);

struct ParsedHex {
  Bytes bytes;
  bool masked = false;  ///< some bytes were "**" and are replaced by another byte
};
/// Parses "3E 31 ** 0D"; nothing if the text is not hexadecimal.
std::optional<ParsedHex> ParseMaskedHex(std::string_view text);

/// The outcome in the text after "=": "corrupt, 27.3 ms: checksum".
std::optional<Outcome> OutcomeOf(std::string_view end);
/// The text after the colon; empty: there is none.
std::string_view ReasonOf(std::string_view end);

using Decoders = std::map<std::string, ExchangeDecoder>;
using ProtocolFinder = std::function<const protocols::Protocol*(const std::string&)>;
/// Returns decoders for all devices of a running line, or only for the device `only`. A device
/// whose protocol is not found gets no decoder.
Decoders DecodersOf(const config::Line& line, const ProtocolFinder& find,
                    const std::string& only = "");

class FrameLines {
 public:
  /// More bytes are not one frame and are printed in several lines.
  static constexpr std::size_t kMostBytes = 8192;

  /// Bytes of a device without a decoder are printed without their meaning.
  explicit FrameLines(Decoders decoders) : decoders_(std::move(decoders)) {}

  /// Returns the lines that are complete with this record.
  std::vector<std::string> Take(const std::string& record);
  /// True if unasked bytes are held that may be incomplete; no end of an exchange will follow them.
  bool waits() const { return !exchange_ && !held_.reply.empty(); }
  /// Returns the held bytes as lines, at the end or after a pause.
  std::vector<std::string> Flush();

 private:
  /// Received bytes that have not been printed yet.
  struct Held {
    std::string time;
    std::string device;
    std::string shown;
    Bytes reply;
    std::vector<bool> masked;
    Duration last{};  ///< time of day of the newest byte
  };

  void Hold(const TraceLine& piece);
  void End(const TraceLine& end, const std::string& record, std::vector<std::string>& lines);
  bool FlushMessages(const Held& held, std::vector<std::string>& lines);
  static void AddLine(const Held& held, std::size_t from, std::size_t to,
                      const std::string& meaning, std::vector<std::string>& lines);
  void FlushHeld(const std::string& meaning, std::size_t first_frame,
                 std::vector<std::string>& lines);

  Decoders decoders_;
  std::optional<Capture> exchange_;  // the exchange that is under way
  Duration asked_{};                 // time of day of the request
  Held held_;
};

}  // namespace baudgate::diagnosis
