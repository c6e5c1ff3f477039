// ExchangeDecoder says what the exchanges of one device mean, by the rules and codecs of the
// daemon, for `decode`, `trace` and the web page. Capture is one exchange as it was recorded,
// and FrameLines makes lines of the records of a trace.
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

// One exchange as it was recorded: for ExchangeDecoder.
struct Capture {
  bool unasked = false;  ///< there is no request: a device may have sent it by itself
  int line = 0;          ///< of the recording, where it begins
  Bytes request{};
  Bytes reply{};
  bool request_masked = false;
  bool reply_masked = false;
  std::string time{};   ///< of a trace, and so is all below
  Duration heard_at{};  ///< of the day, its newest bytes
  std::string device{};
  std::optional<Outcome> told{};  ///< how it ended when it was recorded
  std::string why{};              ///< and the reason that was recorded with it
  bool ended = false;             ///< what comes now belongs to no exchange
  bool last = false;              ///< nothing follows it in the recording

  /// More may have come than was recorded.
  bool is_open() const { return !time.empty() && !told; }
};

struct DecodedValue {
  std::string name;  ///< of the point; where there is none, how the protocol calls it
  Value value{};
  std::string unit{};
  Quality quality{};
  bool is_point = false;
};

/// "current_l1 0.5 xIn", "current_l2 - xIn (bad: not connected)".
std::string ValueText(const DecodedValue& value);

/// Where a trace tells how an exchange ended, that is its outcome: times decide, too. The reason
/// says what the bytes alone would be where that differs, and there are no values then. Where a
/// trace does not tell it and no whole frame came, the outcome is `none`: more may have come than
/// was recorded. Bytes that a trace shows as ** are unknown, and there are no values that would
/// need them.
struct DecodedExchange {
  Outcome outcome = Outcome::none;
  std::string reason;
  std::vector<DecodedValue> values;
};

/// What a device has said by itself.
struct HeardMessage {
  std::size_t end = 0;  ///< how many of the bytes it ends behind
  DecodedExchange decoded;
};

class ExchangeDecoder {
 public:
  /// `line` has this one device, with every option; the protocol is the device's.
  ExchangeDecoder(config::Line line, const protocols::Protocol& protocol);

  DecodedExchange Decode(const Capture& capture);
  /// How many bytes of the reply the first whole frame ends behind; all where there is none.
  std::size_t FirstFrame(const Capture& capture) const;

  /// The device speaks by itself.
  bool Listens() const { return conversation_->Listens() != nullptr; }
  /// The messages in these bytes. What is none of them is said in front of the next one, or at
  /// the end.
  std::vector<HeardMessage> Hear(View bytes);

 private:
  DecodedExchange ToExchange(protocols::Answer answer) const;

  std::unique_ptr<config::Line> line_;  // of the one device, which must not move
  const protocols::Protocol* protocol_;
  std::unique_ptr<protocols::Bus> bus_;
  protocols::ParsedOptions options_;
  std::unique_ptr<protocols::Conversation> conversation_;
};

// The records of a trace, byte by byte as they came, as one line for each frame: pieces are put
// together, and what a reply means follows it where its device is known.
//
//   12:23:31.717352 feeder-1 > 3E 31 52 49 31 3A 43 43 0D | >1RI1:CC.
//   12:23:31.735202 feeder-1 < 0A 3C 31 44 3A … 0D 0A | current_l1 0.52 xIn
//   12:23:31.774724 feeder-1 = ok, 57.4 ms
//   12:23:32.000000 - < 41 42 | AB
//   12:23:33.000000 feeder-2 = no_reply: no reply after 500 ms
//
// `decode` reads them as it reads the records. Pure: text in, text out.
//
// ReadTraceLine reads one line of a capture.

// One line of a capture: what `trace` prints, the flight recorder saves, or somebody has written.
//
//   > 3E 31 52 49
//   04:05:06.143210 feeder-1 < 3C 31 44 3A | <1D:
//   04:05:06.143300 feeder-1 = corrupt, 19.8 ms: checksum

/// A mark (0: none) and what follows it; of a trace also when and with which device. Parts of
/// the line.
struct TraceLine {
  char mark = 0;
  std::string_view rest;  ///< without the characters behind '|'
  std::string_view time;
  std::string_view device;
  std::string_view shown;  ///< the characters behind '|'
};
TraceLine ReadTraceLine(std::string_view line);

/// Bytes that nobody asked for and that come later than this belong to no message before them.
inline constexpr Duration kApart = 50ms;
/// The time since midnight of "04:05:06.123456"; zero: it is none.
Duration TimeOfDay(std::string_view clock);
/// From one time of day to the next, over midnight as well.
Duration Between(Duration from, Duration to);

struct ParsedHex {
  Bytes bytes;
  bool masked = false;  ///< some were "**", in whose place stands another byte
};
/// "3E 31 ** 0D"; nothing when it is none.
std::optional<ParsedHex> ParseMaskedHex(std::string_view text);

/// The outcome in what follows "=": "corrupt, 27.3 ms: checksum".
std::optional<Outcome> OutcomeOf(std::string_view end);
/// What follows its colon; empty: nothing does.
std::string_view ReasonOf(std::string_view end);

/// By the name of the device.
using Decoders = std::map<std::string, ExchangeDecoder>;
using ProtocolFinder = std::function<const protocols::Protocol*(const std::string&)>;
/// Decoders of all devices of a running line, or of one. If a protocol is not found, its device has
/// none.
Decoders DecodersOf(const config::Line& line, const ProtocolFinder& find,
                    const std::string& only = "");

class FrameLines {
 public:
  /// More than that is no frame: it stands in several lines.
  static constexpr std::size_t kMostBytes = 8192;

  /// Bytes of a device without a decoder are shown as they are.
  explicit FrameLines(Decoders decoders) : decoders_(std::move(decoders)) {}

  /// Lines that are whole with this record.
  std::vector<std::string> Take(const std::string& record);
  /// Whether bytes wait for others that may belong to them, and for no end of an exchange.
  bool waits() const { return !exchange_ && !held_.reply.empty(); }
  /// What waits, at the end or where nothing more has come.
  std::vector<std::string> Flush();

 private:
  /// Received bytes that are no line yet.
  struct Held {
    std::string time;
    std::string device;
    std::string shown;
    Bytes reply;
    std::vector<bool> masked;
    Duration last{};  ///< of the day, of its newest byte
  };

  void Hold(const TraceLine& piece);
  void End(const TraceLine& end, const std::string& record, std::vector<std::string>& lines);
  bool FlushMessages(const Held& held, std::vector<std::string>& lines);
  static void AddLine(const Held& held, std::size_t from, std::size_t to,
                      const std::string& meaning, std::vector<std::string>& lines);
  void FlushHeld(const std::string& meaning, std::size_t first_frame,
                 std::vector<std::string>& lines);

  Decoders decoders_;
  std::optional<Capture> exchange_;  // that is under way
  Duration asked_{};                 // when, of the day
  Held held_;
};

}  // namespace baudgate::diagnosis
