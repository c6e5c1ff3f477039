// `TraceRecord` is a piece of a line's traffic as users see it: direction, time in microseconds,
// bytes with secrets masked. ToText makes one line of text of it, which `baudgate decode` reads.
// gateway/records/trace/line_recorder.h makes the records; they go to gateway/outputs/control and
// to the files of the flight recorder.
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
    end,  ///< the end of an exchange: outcome, round trip, reason
    note,
  };
  Kind kind = Kind::note;
  WallTime at{};
  std::string device;  ///< name of the device; empty: the record is about the line
  std::string hex;     ///< for sent and received: "3E 31 ** **", secret bytes as **
  /// For sent and received, the bytes as characters, with dots for bytes that cannot be shown; else
  /// the text of the note.
  std::string text;
  Outcome outcome = Outcome::none;  ///< for `end`
  Duration round_trip{};            ///< for `end`
};

/// Returns one line without its end, for example:
///   04:05:06.123456 feeder-1 > 3E 31 52 49 31 3A 43 43 0D | >1RI1:CC.
///   04:05:06.143210 feeder-1 < 3C 31 44 3A ... | <1D:...
///   04:05:06.143300 feeder-1 = ok, 19.8 ms
///   04:05:09.000000 feeder-1 # offline: no_reply
/// `baudgate decode` reads the lines with > and <; times are UTC.
std::string ToText(const TraceRecord& record);

/// Queues records between a line's thread and a slow reader. Records beyond kMostRecords are
/// dropped, and a note tells how many.
class TraceQueue {
 public:
  static constexpr std::size_t kMostRecords = 4096;
  explicit TraceQueue(std::function<void()> wake) : wake_(std::move(wake)) {}
  void Push(const TraceRecord& record);
  /// Returns all records, oldest first. Does not wait.
  std::vector<TraceRecord> Take();

 private:
  std::function<void()> wake_;
  Mutex mutex_;
  std::deque<TraceRecord> records_ BAUDGATE_GUARDED_BY(mutex_);
  std::uint64_t dropped_ BAUDGATE_GUARDED_BY(mutex_) = 0;
};

// `TraceHead` and `ReadTracedDevice` write and read comments at the top of a trace or recording.
// They tell `baudgate decode` what it needs to know about a line to interpret its bytes.
//
//   # line bay-1, port /dev/ttyUSB0 9600 7E1, protocol spabus
//   # device feeder-1, protocol spabus, profile spaj140c, set checksum=off

struct TracedDevice {
  std::string name{};
  std::string protocol{};
  std::string profile{};
  std::vector<std::string> set{};  ///< configured options, "key=value"; never a secret
  bool operator==(const TracedDevice&) const = default;
};

/// Returns the comments for a line: one for the line, then one for each device.
std::vector<std::string> TraceHead(const config::Line& line);
/// Reads the comment of a device; empty: `line` is not such a comment.
std::optional<TracedDevice> ReadTracedDevice(std::string_view line);

}  // namespace baudgate::records
