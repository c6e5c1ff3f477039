// The bytes of a line as users see them: records with direction and microseconds, secrets masked,
// one line of text each that `baudgate decode` reads back. Made by
// gateway/records/trace/line_recorder.h, read by gateway/outputs/control and the files of the
// flight recorder. TraceHead describes the line on top of a trace.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/line.h"
#include "gateway/base/guarded.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"

namespace baudgate::records {

struct TraceRecord {
  enum class Kind : std::uint8_t {
    sent,
    received,
    end,   ///< of an exchange: outcome, round trip, reason
    note,  ///< anything else worth a line: a device went offline, records were dropped
  };
  Kind kind = Kind::note;
  WallTime at{};
  std::string device;  ///< its name; empty where none is concerned
  std::string hex;     ///< of sent and received: "3E 31 ** **", secret bytes as **
  std::string text;    ///< the same bytes as characters, dots for what cannot be shown; or the note
  Outcome outcome = Outcome::none;  ///< of end
  Duration round_trip{};            ///< of end
};

/// One line without its end:
///   04:05:06.123456 feeder-1 > 3E 31 52 49 31 3A 43 43 0D | >1RI1:CC.
///   04:05:06.143210 feeder-1 < 3C 31 44 3A ... | <1D:...
///   04:05:06.143300 feeder-1 = ok, 19.8 ms
///   04:05:09.000000 feeder-1 # offline: no_reply
/// `baudgate decode` reads the lines with > and <; times are UTC.
std::string ToText(const TraceRecord& record);

/// Between a line's thread and a slow reader: bounded; what does not fit is dropped, and a note in
/// its place says how much.
class TraceQueue {
 public:
  static constexpr std::size_t kMostRecords = 4096;
  explicit TraceQueue(std::function<void()> wake) : wake_(std::move(wake)) {}
  void Push(const TraceRecord& record);
  /// All that is there, oldest first; never waits.
  std::vector<TraceRecord> Take();

 private:
  std::function<void()> wake_;
  Mutex mutex_;
  std::deque<TraceRecord> records_ BAUDGATE_GUARDED_BY(mutex_);
  std::uint64_t dropped_ BAUDGATE_GUARDED_BY(mutex_) = 0;
};

// What `decode` has to know of a line to say what its bytes mean: comments on top of a trace and of
// a recording. Written by the gateway, read back by gateway/tools/cli/offline.
//
//   # line bay-1, port /dev/ttyUSB0 9600 7E1, protocol spabus
//   # device feeder-1, protocol spabus, profile spaj140c, set checksum=off

/// What `decode` is told of one device.
struct TracedDevice {
  std::string name{};
  std::string protocol{};
  std::string profile{};           ///< empty: none
  std::vector<std::string> set{};  ///< options that were given, "key=value"; never a secret
  bool operator==(const TracedDevice&) const = default;
};

std::vector<std::string> TraceHead(const config::Line& line);
/// Nothing where the line is no such comment.
std::optional<TracedDevice> ReadTracedDevice(std::string_view line);

}  // namespace baudgate::records
