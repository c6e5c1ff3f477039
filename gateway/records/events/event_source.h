// `EventSource` is the interface to events and alarms for gateway/outputs/status and
// gateway/outputs/control. Thread-safe.
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

// `ReadPage` uses a separate connection, so no writer waits. The file can contain anything.

/// About 40 kB on the control socket.
inline constexpr std::size_t kPage = 200;

struct PageQuery {
  std::int64_t after = 0;           ///< returns only events with a greater number
  std::string line{};               ///< empty: all lines
  std::string device{};             ///< without its line; empty: all devices
  std::optional<WallTime> since{};  ///< received at this time or later
};

struct Page {
  std::vector<EventRecord> records;  ///< sorted by number
  std::int64_t next = 0;             ///< value of `after` for the next page
  bool more = false;
};

Result<Page> ReadPage(records::Database& database, const PageQuery& query);
/// A page with many values contains fewer events.
Result<Page> ReadPage(const std::filesystem::path& file, const PageQuery& query,
                      bool* damaged = nullptr);

struct Consumer {
  std::string name;
  std::int64_t seq = 0;
  std::int64_t lost = 0;  ///< deleted before the consumer received them
};

struct EventsState {
  records::Disk disk = records::Disk::opening;
  std::string trouble;
  WallTime since{};
  std::size_t waiting = 0;  ///< batches of devices
  std::int64_t newest = 0;
  std::int64_t oldest = 0;
  std::vector<Consumer> consumers{};
  std::uint64_t repeats = 0;  ///< events that devices sent twice, since the start
  /// See Shares; since the start.
  std::uint64_t left_out = 0;
  std::size_t alarms_active = 0;
  std::size_t alarms_unacknowledged = 0;
  std::string file;
  std::vector<std::string> put_aside{};
  bool in_memory = false;  ///< only the gateway's own alarms
};

struct AckQuery {
  std::string line{};
  std::string device{};
  std::string point{};  ///< empty: the alarms of the device and of all its points
  /// Not 0: only the alarm that this event has raised.
  std::int64_t seq = 0;
  /// The low 32 bits of the number of the event that has raised the alarm.
  std::optional<std::uint32_t> number{};
  bool all = false;
  std::string by{};  ///< "user:anna"

  bool Means(const Alarm& alarm) const {
    if (seq != 0) return alarm.seq == seq;
    if (number && static_cast<std::uint32_t>(alarm.seq) != *number) return false;
    return all || (alarm.line == line && alarm.device == device &&
                   (point.empty() || alarm.point == point));
  }
};

struct Acknowledged {
  std::size_t alarms = 0;
  std::string trouble{};  ///< empty: it is saved
  WallTime at{};
};

class EventSource {
 public:
  virtual ~EventSource() = default;
  virtual EventsState state() const = 0;
  virtual std::vector<Alarm> Alarms() const = 0;
  /// Returns the number of selected alarms. `done` is called once, on any thread, also within this
  /// call.
  virtual std::size_t Acknowledge(const AckQuery& query,
                                  std::function<void(const Acknowledged&)> done) = 0;
  /// Returns an empty page while the file is being opened.
  virtual Result<Page> Read(const PageQuery& query) const = 0;
  virtual Result<PastPage> ReadPast(const PastQuery& query) const = 0;
};

}  // namespace baudgate::events
