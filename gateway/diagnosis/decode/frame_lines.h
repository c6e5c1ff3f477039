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
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/diagnosis/decode/exchange_decoder.h"
#include "gateway/diagnosis/decode/trace_line.h"

namespace baudgate {

/// By the name of the device.
using Decoders = std::map<std::string, ExchangeDecoder>;
using ProtocolFinder = std::function<const Protocol*(const std::string&)>;
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

}  // namespace baudgate
