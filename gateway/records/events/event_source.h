// `EventSource` is the interface to events and alarms for gateway/outputs/status and
// gateway/outputs/control. Thread-safe.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/records/disk/database.h"
#include "gateway/records/disk/disk.h"
#include "gateway/records/events/event_record.h"
#include "gateway/records/events/record_table.h"

namespace baudgate::events {

// `ReadPage` reads stored events page by page, for `baudgate events`. It uses a separate
// connection, so no writer waits for it. The file may be damaged, so every field is checked.

/// The limit of events in one page: about 40 kB on the control socket.
inline constexpr std::size_t kPage = 200;

struct PageQuery {
  std::int64_t after = 0;           ///< returns only events with a greater number
  std::string line{};               ///< empty: all lines
  std::string device{};             ///< name of the device without its line; empty: all devices
  std::optional<WallTime> since{};  ///< returns only events received at this time or later
  std::optional<WallTime> until{};  ///< returns only events received before this time
  std::optional<config::EventState> state{};
  std::optional<config::AlarmPriority> priority{};  ///< none: returns only events without an alarm
  /// Returns only events with this part of a text, in upper or lower case of ASCII.
  std::string text{};
};

struct Page {
  std::vector<EventRecord> records;  ///< sorted by number
  std::int64_t next = 0;             ///< value of `after` for the next page
  bool more = false;
};

Result<Page> ReadPage(records::Database& database, const PageQuery& query);
/// Reads a page of the events with their records; see ReadOnce. A page with many values contains
/// fewer events.
Result<Page> ReadPage(const std::filesystem::path& file, const PageQuery& query,
                      bool* damaged = nullptr);

struct Consumer {
  std::string name;
  std::int64_t seq = 0;
  std::int64_t lost = 0;  ///< number of events that were deleted before the consumer received them
};

struct EventsState {
  records::Disk disk = records::Disk::opening;
  std::string trouble;
  WallTime since{};
  std::size_t waiting = 0;  ///< number of batches of devices that are not on the disk
  std::int64_t newest = 0;
  std::int64_t oldest = 0;
  std::vector<Consumer> consumers{};
  std::uint64_t repeats = 0;  ///< number of events that devices sent twice, since the start
  /// Number of the gateway's events that were left out (see Shares), since the start.
  std::uint64_t left_out = 0;
  std::size_t alarms_active = 0;
  std::size_t alarms_unacknowledged = 0;
  std::string file;
  std::vector<std::string> put_aside{};
  bool in_memory = false;  ///< true: there is no file, only the gateway's own alarms in memory
};

struct AckQuery {
  std::string line{};
  std::string device{};
  std::string point{};  ///< empty: the alarms of the device and of all its points
  /// Not empty: selects only the alarms that the events of these numbers have raised, of any
  /// device. An alarm that was raised again since then is not selected.
  std::vector<std::int64_t> seqs{};
  /// If set: selects only alarms raised by an event whose number has these low 32 bits.
  std::optional<std::uint32_t> number{};
  bool all = false;
  bool whole_line = false;  ///< all alarms of `line`, of its devices and their points
  std::string by{};         ///< the person: "user:anna"

  bool Means(const Alarm& alarm) const {
    if (!seqs.empty()) return std::ranges::find(seqs, alarm.seq) != seqs.end();
    if (number && static_cast<std::uint32_t>(alarm.seq) != *number) return false;
    if (whole_line) return alarm.line == line;
    return all || (alarm.line == line && alarm.device == device &&
                   (point.empty() || alarm.point == point));
  }
};

struct Acknowledged {
  std::size_t alarms = 0;
  std::string trouble{};  ///< why the acknowledgement is not on the disk; empty: it is saved
  WallTime at{};
};

class EventSource {
 public:
  virtual ~EventSource() = default;
  virtual EventsState state() const = 0;
  virtual std::vector<Alarm> Alarms() const = 0;
  /// Acknowledges the selected alarms and returns their number. `done` is called once, when the
  /// acknowledgement is on the disk or the disk fails: on any thread, also within this call.
  virtual std::size_t Acknowledge(const AckQuery& query,
                                  std::function<void(const Acknowledged&)> done) = 0;
  /// Returns an empty page while the file is being opened.
  virtual Result<Page> Read(const PageQuery& query) const = 0;
  virtual Result<PastPage> ReadPast(const PastQuery& query) const = 0;
};

}  // namespace baudgate::events
