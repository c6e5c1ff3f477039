// `PointStore` contains the latest value of every point with its quality and time, and the status
// of every device and line. Lines write to it, outputs read from it. Thread-safe: each device has
// one lock, so a reader gets a consistent record of a device. `ChangeFeed` reports changes to an
// output, and AgedQuality makes a quality worse by age. readings.h has the conversion of readings.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "config/model/line.h"
#include "config/model/point.h"
#include "gateway/base/guarded.h"
#include "gateway/base/steady_vector.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/bus/points/device_status.h"
#include "gateway/bus/points/line_status.h"
#include "gateway/bus/points/readings.h"

namespace baudgate::bus {

// `ChangeFeed` is the way from the point store to an output: which points and devices have changed
// since the output last looked. A slow output gets the latest state of each and never a backlog, so
// memory is limited by the number of points. Threads of lines fill it; the thread of the output
// drains it.
struct PointRef {
  std::uint32_t device = 0;  ///< index in the point store
  std::uint32_t point = 0;   ///< index in the device's points
};

struct Changes {
  std::vector<PointRef> points;
  std::vector<std::uint32_t> devices;  ///< devices whose state or counters changed

  bool empty() const { return points.empty() && devices.empty(); }
};

class ChangeFeed {
 public:
  /// points_per_device[d] is the number of points of device d.
  explicit ChangeFeed(std::span<const std::size_t> points_per_device);

  void AddDevice(std::size_t points);

  void MarkPoints(std::uint32_t device, std::span<const std::uint32_t> points);
  void MarkDevice(std::uint32_t device);

  /// Moves all pending changes into `out`, which is cleared first. Waits for the first change, at
  /// most until `until`. Also returns, possibly with nothing, after Wake.
  void Drain(Instant until, Changes& out);
  /// Ends a waiting Drain at once, so that the output can stop.
  void Wake();

 private:
  Mutex mutex_;
  std::condition_variable changed_;
  Changes pending_ BAUDGATE_GUARDED_BY(mutex_);
  std::vector<std::vector<bool>> point_pending_ BAUDGATE_GUARDED_BY(mutex_);
  std::vector<bool> device_pending_ BAUDGATE_GUARDED_BY(mutex_);
  bool woken_ BAUDGATE_GUARDED_BY(mutex_) = false;
};

// The record of a device in the point store: the latest reading of every point, the status of the
// device, and the age limits of its values. AgedQuality returns the quality.
struct PointRecord {
  Value value;  ///< the last value that was not bad; empty before the first
  Quality reported = Quality::bad_waiting;  ///< quality of the last reading, without age and state
  /// Best quality until the next reading: the value was doubted or too old.
  Quality at_best = Quality::good;
  /// End of the reply (monotonic clock). Earlier for a late reply, because its value is as old as
  /// its request.
  std::optional<Instant> read_at;
  WallTime source_time{};  ///< `read_at` as civil time
  std::uint64_t seq = 0;   ///< number of readings of this point
  std::uint32_t rtt_us = 0;
};

/// Age limits of the values of one group.
struct AgeLimits {
  static constexpr Duration kNever = Duration::max();
  Duration uncertain_after = kNever;
  Duration bad_after = kNever;

  bool ages() const { return uncertain_after != kNever; }
  bool operator==(const AgeLimits&) const = default;
};

/// The quality of all values of a device, whatever their age; empty: each value has its own
/// quality.
using Override = std::optional<Quality>;

struct DeviceRecord {
  std::shared_ptr<const config::Line> line;
  std::shared_ptr<const config::Device> device;  ///< a part of `line`
  std::vector<PointRecord> points;               ///< same indices as device->points
  DeviceStatus status;
  Override override_quality;
  Duration line_cycle{};  ///< measured time in which the line reads all its fast points once
  std::array<AgeLimits, config::kGroups> age_limits;  ///< by config::Group
  /// Increased with every reading, override and age limit. While it is unchanged, only age changes
  /// a quality.
  std::uint64_t version = 0;
};

// The quality of a stored value at a moment: the quality of the last reading, made worse by doubt,
// by age, and by the state of device and line. Pure functions.

/// Returns the limits by config::Group. `line_cycle`: the measured time that the line needs to read
/// all its fast points once; no value is too old before two of them.
std::array<AgeLimits, config::kGroups> LimitsOf(const config::Device& device, Duration line_cycle);

/// Returns the quality of the last reading, made worse by doubt and age, without the state of
/// device and line.
Quality AgedQuality(const DeviceRecord& record, std::size_t point, Instant now);

/// Returns the quality, in this order of precedence: out of service, line down, device offline,
/// another device than configured, never read, reported trouble, then age.
Quality QualityAt(const DeviceRecord& record, std::size_t point, Instant now);

/// Returns the time since the reading; empty before the first.
std::optional<Duration> AgeAt(const DeviceRecord& record, std::size_t point, Instant now);

/// Returns when age alone changes the quality of the point next, seen from `now`; empty: never.
std::optional<Instant> NextAgeing(const DeviceRecord& record, std::size_t point, Instant now);

class PointStore {
 public:
  explicit PointStore(const config::Config& config);

  std::uint32_t device_count() const { return static_cast<std::uint32_t>(devices_.size()); }
  /// Returns the present configuration; a reload may replace it. Null: the device is forgotten.
  std::shared_ptr<const config::Line> line(std::uint32_t device) const;
  std::shared_ptr<const config::Device> device(std::uint32_t device) const;
  /// Returns the number of points, even if the device is forgotten.
  std::size_t point_count(std::uint32_t device) const { return devices_[device].point_count; }
  /// True if a reload has removed the device. Its number is not used again.
  bool gone(std::uint32_t device) const { return devices_[device].gone; }
  std::uint32_t present_count() const;

  /// Calls `look` with the record of the device, under its lock. Keep the call short, and call no
  /// function of the store in it. Returns false, without a call, if the device is forgotten.
  bool Read(std::uint32_t device, const std::function<void(const DeviceRecord&)>& look) const;
  /// Returns an object that keeps the device from being forgotten. Null: the device is forgotten
  /// already.
  std::shared_ptr<const void> Hold(std::uint32_t device) const;

  /// Stores points that were read in one exchange. `at`: see PointRecord::read_at.
  void Update(std::uint32_t device, std::span<const Sample> samples, Now at, Duration round_trip);
  /// Makes those of these points that are good uncertain until they are read again. Values and ages
  /// stay.
  void Doubt(std::uint32_t device, std::span<const std::size_t> points, Instant now);
  void SetOverride(std::uint32_t device, Override why);
  /// Sets the measured time that the line needs to read all its fast points once. The age limits
  /// depend on it. A value that is too old when they change stays too old until it is read again.
  void SetLineCycle(std::uint32_t device, Duration cycle, Instant now);
  /// Changes the status under the lock and notifies the feeds.
  void UpdateStatus(std::uint32_t device, const std::function<void(DeviceStatus&)>& change);

  /// Returns the number of the present line of this name. Lines are numbered in the order of the
  /// file.
  std::uint32_t LineIndex(const config::Line& line) const;
  /// Returns the line as it was appended. Null: the line is gone.
  std::shared_ptr<const config::Line> LineAt(std::uint32_t line) const;
  /// Returns the status of a line. A forgotten line has the status of a new line.
  LineStatus ReadLine(std::uint32_t line) const;
  /// Changes the status of a line under its lock, unless the line is forgotten.
  void UpdateLine(std::uint32_t line, const std::function<void(LineStatus&)>& change);

  /// Returns a feed of all changes from now on.
  std::shared_ptr<ChangeFeed> Subscribe();
  void Unsubscribe(const std::shared_ptr<ChangeFeed>& feed);

  // Functions for a reload: one thread at a time, while other threads use the store.

  /// Adds a line. The line and its devices get the next numbers.
  void Append(const std::shared_ptr<const config::Line>& line);
  /// Gives the line another configuration of the same devices and points. New age limits apply to
  /// old readings as well, because the user has changed the rule. A value that was too old when
  /// SetLineCycle changed the limits stays too old until it is read again.
  void Reconfigure(std::uint32_t line, const std::shared_ptr<const config::Line>& as);
  /// The devices of this line are no longer polled. Their data stay until Forget.
  void Retire(std::uint32_t line);
  /// Frees status, readings and configuration of a retired line, when outputs use other devices.
  /// Data that are held (Hold) stay as long as they are held. Later changes to the line do nothing.
  void Forget(std::uint32_t line);

  /// Reports to the feeds all points whose quality has changed by age alone since the last report.
  /// The daemon calls it every 200 ms (gateway/daemon/ticker.h); devices that cannot have aged cost
  /// no time.
  void Age(Instant now);

 private:
  struct Entry {
    Entry(const std::shared_ptr<const config::Line>& line, const config::Device& device);
    const std::size_t point_count;
    // As in the record, but readable without its lock, also from within Read.
    std::atomic<std::weak_ptr<const config::Line>> line;
    std::atomic<std::weak_ptr<const config::Device>> device;
    std::atomic<bool> gone = false;
    mutable Mutex mutex;
    std::shared_ptr<DeviceRecord> own BAUDGATE_GUARDED_BY(mutex);  // null after Forget
    std::weak_ptr<DeviceRecord> record BAUDGATE_GUARDED_BY(mutex);
    /// The qualities that were last reported to the feeds.
    std::vector<Quality> announced BAUDGATE_GUARDED_BY(mutex);
    Instant next_ageing BAUDGATE_GUARDED_BY(mutex) = Instant::max();
  };

  void Announce(std::uint32_t device, std::span<const std::uint32_t> points);
  static void ScheduleAgeing(Entry& entry, const DeviceRecord& record, std::size_t point,
                             Instant now) BAUDGATE_REQUIRES(entry.mutex);
  /// Returns the number after that of the last device of the line.
  std::size_t EndOfDevices(std::uint32_t line) const;

  struct LineEntry {
    LineEntry(std::shared_ptr<const config::Line> its_line, std::uint32_t its_first)
        : first_device(its_first), line(std::move(its_line)) {}
    const std::uint32_t first_device;
    mutable Mutex mutex;
    std::shared_ptr<const config::Line> line BAUDGATE_GUARDED_BY(mutex);  // null: the line is gone
    std::unique_ptr<LineStatus> status BAUDGATE_GUARDED_BY(mutex) =       // null after Forget
        std::make_unique<LineStatus>();
  };

  SteadyVector<Entry> devices_;
  SteadyVector<LineEntry> lines_;
  mutable Mutex feeds_mutex_;
  std::vector<std::shared_ptr<ChangeFeed>> feeds_ BAUDGATE_GUARDED_BY(feeds_mutex_);
};

}  // namespace baudgate::bus
