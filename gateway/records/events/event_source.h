// The events as gateway/outputs/status and gateway/outputs/control see them. From any thread.
// ReadPage reads kept events page by page.
// SPDX-License-Identifier: Apache-2.0
#pragma once

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

// Reads kept events, page by page, for `baudgate events`: over a connection of its own, so nothing
// waits for it. The file may contain anything; every field is checked.

/// Records of one page: about 40 kB of the control socket.
inline constexpr std::size_t kPage = 200;

struct PageQuery {
  std::int64_t after = 0;           ///< a number
  std::string line{};               ///< empty: of all
  std::string device{};             ///< its bare name; empty: of all
  std::optional<WallTime> since{};  ///< only events received at this time or later
};

struct Page {
  std::vector<EventRecord> records;  ///< by their numbers
  std::int64_t next = 0;             ///< `after` of the next page
  bool more = false;                 ///< there were more at that time
};

Result<Page> ReadPage(records::Database& database, const PageQuery& query);
/// See ReadOnce; with the records of the events. A page with many values is shorter.
Result<Page> ReadPage(const std::filesystem::path& file, const PageQuery& query,
                      bool* damaged = nullptr);

/// A consumer of all events, whose position is kept in the file.
struct Consumer {
  std::string name;
  std::int64_t seq = 0;  ///< it has this event, and all before
  std::int64_t lost =
      0;  ///< events that it has not got and that the file no longer has: there was no room
};

struct EventsState {
  records::Disk disk = records::Disk::opening;
  std::string trouble;  ///< why it fails; empty: it does not
  WallTime since{};     ///< of `disk`
  std::size_t waiting =
      0;  ///< messages of devices, which are not asked for more until these are kept
  std::int64_t newest = 0;  ///< number of the last that is kept; 0: none is
  std::int64_t oldest = 0;  ///< of the first
  std::vector<Consumer> consumers{};
  std::uint64_t repeats = 0;   ///< that came twice, since the start
  std::uint64_t left_out = 0;  ///< of the gateway's own, too many of one kind, since the start
  std::size_t alarms_active = 0;
  std::size_t alarms_unacknowledged = 0;
  std::string file;
  std::vector<std::string> put_aside{};  ///< damaged files that are still there, by name
  bool in_memory = false;                ///< there is no file, and only alarms of the gateway's own
};

/// The alarms that a person acknowledges, and the person.
struct AckQuery {
  std::string line{};
  std::string device{};
  std::string point{};   ///< empty: of the device, and of all its points
  std::int64_t seq = 0;  ///< not 0: the alarm that this event has raised, of any device
  /// Only the alarm raised by an event with these low 32 bits.
  std::optional<std::uint32_t> number{};
  bool all = false;  ///< of every line and device
  std::string by{};  ///< "user:anna"

  bool Means(const Alarm& alarm) const {
    if (seq != 0) return alarm.seq == seq;
    if (number && static_cast<std::uint32_t>(alarm.seq) != *number) return false;
    return all || (alarm.line == line && alarm.device == device &&
                   (point.empty() || alarm.point == point));
  }
};

struct Acknowledged {
  std::size_t alarms = 0;  ///< that waited for it
  std::string trouble{};   ///< why it is not on the disk yet; empty: it is
  WallTime at{};           ///< when it was asked for
};

class EventSource {
 public:
  virtual ~EventSource() = default;
  virtual EventsState state() const = 0;
  /// Alarms that are not normal.
  virtual std::vector<Alarm> Alarms() const = 0;
  /// Returns how many alarms wait for it. `done` is called once, from any thread, also within this
  /// call.
  virtual std::size_t Acknowledge(const AckQuery& query,
                                  std::function<void(const Acknowledged&)> done) = 0;
  /// Empty while the file is being opened.
  virtual Result<Page> Read(const PageQuery& query) const = 0;
  virtual Result<PastPage> ReadPast(const PastQuery& query) const = 0;
};

}  // namespace baudgate::events
