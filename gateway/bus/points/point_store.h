// `PointStore` contains the latest value of every point with its quality and time, and the status
// of every device and line. Lines write to it, outputs read from it. It is thread-safe: each device
// has one lock, so a reader gets a consistent record of a device. `ChangeFeed` reports changes to
// an output. AgedQuality makes the quality of a value worse as the value gets older.
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

// `ChangeFeed` contains which points and devices have changed in the point store since an output
// last asked. A point that changed several times is contained once, so the memory is limited by the
// number of points, and a slow output skips old values. The threads of the lines add changes, and
// the thread of the output takes them.
struct PointRef {
  std::uint32_t device = 0;  ///< index in the point store
  std::uint32_t point = 0;
};

struct Changes {
  std::vector<PointRef> points;
  std::vector<std::uint32_t> devices;  ///< devices whose state or counters changed

  bool empty() const { return points.empty() && devices.empty(); }
};

class ChangeFeed {
 public:
  explicit ChangeFeed(std::span<const std::size_t> points_per_device);

  void AddDevice(std::size_t points);

  void MarkPoints(std::uint32_t device, std::span<const std::uint32_t> points);
  void MarkDevice(std::uint32_t device);

  /// Moves all changes into `out`, which is cleared first. Waits until there is a change, at most
  /// until `until`. After Wake it returns at once, also without a change.
  void Drain(Instant until, Changes& out);
  /// Makes a waiting Drain return at once, so that the output can stop.
  void Wake();

 private:
  Mutex mutex_;
  std::condition_variable changed_;
  Changes pending_ BAUDGATE_GUARDED_BY(mutex_);
  std::vector<std::vector<bool>> point_pending_ BAUDGATE_GUARDED_BY(mutex_);
  std::vector<bool> device_pending_ BAUDGATE_GUARDED_BY(mutex_);
  bool woken_ BAUDGATE_GUARDED_BY(mutex_) = false;
};

// `DeviceRecord` is the record of a device in the point store: the latest reading of every point
// (`PointRecord`), the status of the device, and the age limits of its values.
struct PointRecord {
  Value value;  ///< the last value that was not bad; empty: there was none
  /// Quality of the last reading, whatever its age and the state of the device.
  Quality reported = Quality::bad_waiting;
  /// Best quality that the point can have until the next reading. It is lowered when the value
  /// becomes doubtful or too old.
  Quality at_best = Quality::good;
  /// When the reply with the value ended (monotonic clock). For a late reply it is the time of the
  /// request, because the value may be as old. Empty: never read.
  std::optional<Instant> read_at;
  WallTime source_time{};  ///< `read_at` as civil time
  /// When a write that may have changed the value ended. If the point was not read since
  /// (`read_at`), the gateway does not know its value.
  std::optional<Instant> written_at{};
  std::uint64_t seq = 0;
  std::uint32_t rtt_us = 0;
};

/// The ages at which values of one group become uncertain and bad.
struct AgeLimits {
  static constexpr Duration kNever = Duration::max();
  Duration uncertain_after = kNever;
  Duration bad_after = kNever;

  bool ages() const { return uncertain_after != kNever; }
  bool operator==(const AgeLimits&) const = default;
};

/// If set: the quality of all values of a device, whatever their age, for example while it is
/// offline.
using Override = std::optional<Quality>;

struct DeviceRecord {
  std::shared_ptr<const config::Line> line;
  std::shared_ptr<const config::Device> device;  ///< a part of `line`
  std::vector<PointRecord> points;               ///< same indices as device->points
  DeviceStatus status;
  Override override_quality;
  /// Measured time in which the line reads all points of the group `fast` once.
  Duration line_cycle{};
  std::array<AgeLimits, config::kGroups> age_limits;
  /// Increased with each change of a reading, a doubt, the override or the age limits. While it
  /// stays the same, a quality changes by age only.
  std::uint64_t version = 0;
};

/// Returns the age limits for each config::Group. `line_cycle`: see DeviceRecord. A value becomes
/// too old after twice this time at the earliest.
std::array<AgeLimits, config::kGroups> LimitsOf(const config::Device& device, Duration line_cycle);

/// Returns the quality of the last reading, made worse by doubt and age. The state of the device
/// and the line is not included.
Quality AgedQuality(const DeviceRecord& record, std::size_t point, Instant now);

/// Returns the quality that users see. The first of these that is true decides: out of service,
/// line down, device offline, another device than configured, never read, trouble in the reading;
/// then age.
Quality QualityAt(const DeviceRecord& record, std::size_t point, Instant now);

/// Returns the value of the point; empty if its quality is bad.
Value KnownValue(const DeviceRecord& record, std::size_t point, Instant now);

/// Empty: the point was never read.
std::optional<Duration> AgeAt(const DeviceRecord& record, std::size_t point, Instant now);

/// Returns the next time after `now` at which age alone changes the quality of the point; empty:
/// never.
std::optional<Instant> NextAgeing(const DeviceRecord& record, std::size_t point, Instant now);

class PointStore {
 public:
  explicit PointStore(const config::Config& config);

  std::uint32_t device_count() const { return static_cast<std::uint32_t>(devices_.size()); }
  /// Returns the present configuration of the device's line, which a reload may replace. Null: the
  /// device was removed and forgotten.
  std::shared_ptr<const config::Line> line(std::uint32_t device) const;
  std::shared_ptr<const config::Device> device(std::uint32_t device) const;
  std::size_t point_count(std::uint32_t device) const { return devices_[device].point_count; }
  /// True if a reload has removed the device. No other device gets its number.
  bool gone(std::uint32_t device) const { return devices_[device].gone; }
  std::uint32_t present_count() const;

  /// Calls `look` with the record of the device, while the lock of the record is held. `look` must
  /// be short, and must not call the store. Returns false, without a call, if the device was
  /// forgotten.
  bool Read(std::uint32_t device, const std::function<void(const DeviceRecord&)>& look) const;
  /// Returns an object; while it exists, Forget does not free the data of the device. Null: they
  /// are freed already.
  std::shared_ptr<const void> Hold(std::uint32_t device) const;

  /// Stores the values of points that were read in one exchange. `at`: see PointRecord::read_at.
  void Update(std::uint32_t device, std::span<const Sample> samples, Now at, Duration round_trip);
  /// Makes these points uncertain until they are read again, except points that are not good.
  /// Values and ages stay.
  void Doubt(std::uint32_t device, std::span<const std::size_t> points, Instant now);
  /// Notes that a write may have changed the values of these points, which become uncertain.
  void OnWritten(std::uint32_t device, std::span<const std::size_t> points, Instant now);
  void SetOverride(std::uint32_t device, Override why);
  /// Sets DeviceRecord::line_cycle, on which the age limits depend. A value that is too old by the
  /// old limits stays too old until it is read again.
  void SetLineCycle(std::uint32_t device, Duration cycle, Instant now);
  /// Calls `change` with the status, while its lock is held, and reports the change to the feeds.
  void UpdateStatus(std::uint32_t device, const std::function<void(DeviceStatus&)>& change);

  /// Returns the number of the line with this name that no reload has removed. Lines are numbered
  /// in the order of the configuration; lines that a reload adds get the next numbers.
  std::uint32_t LineIndex(const config::Line& line) const;
  /// Returns the configuration of a line. Null: a reload has removed the line.
  std::shared_ptr<const config::Line> LineAt(std::uint32_t line) const;
  /// Returns the status of a line; of a forgotten line, an empty status.
  LineStatus ReadLine(std::uint32_t line) const;
  /// Calls `change` with the status of the line, while its lock is held. Does nothing if the line
  /// was forgotten.
  void UpdateLine(std::uint32_t line, const std::function<void(LineStatus&)>& change);

  std::shared_ptr<ChangeFeed> Subscribe();
  void Unsubscribe(const std::shared_ptr<ChangeFeed>& feed);

  // The functions for a reload. One thread at a time can call them, while other threads use the
  // store.

  /// Adds a line. The line and its devices get the next numbers.
  void Append(const std::shared_ptr<const config::Line>& line);
  /// Replaces the configuration of a line that has the same devices and points. New age limits
  /// apply to old readings as well, because the user has changed them. A value that was too old
  /// when SetLineCycle made the limits longer stays too old until it is read again.
  void Reconfigure(std::uint32_t line, const std::shared_ptr<const config::Line>& as);
  /// Marks the devices of this line as removed (gone). Their data stay until Forget.
  void Retire(std::uint32_t line);
  /// Frees status, readings and configuration of a retired line. Call when outputs no longer use
  /// them. Data that Hold keeps are freed later. Changes to the line do nothing from now on.
  void Forget(std::uint32_t line);

  /// Reports to the feeds all points whose quality has changed by age since the last call. Called
  /// every 200 ms (gateway/daemon/ticker.h). Devices without a value that can age now are skipped.
  void Age(Instant now);

 private:
  struct Entry {
    Entry(const std::shared_ptr<const config::Line>& line, const config::Device& device);
    const std::size_t point_count;
    // `line` and `device` as in the record. They can be read without the lock, also from within
    // Read.
    std::atomic<std::weak_ptr<const config::Line>> line;
    std::atomic<std::weak_ptr<const config::Device>> device;
    std::atomic<bool> gone = false;
    mutable Mutex mutex;
    std::shared_ptr<DeviceRecord> own BAUDGATE_GUARDED_BY(mutex);  // null after Forget
    std::weak_ptr<DeviceRecord> record BAUDGATE_GUARDED_BY(mutex);
    /// The quality of each point that was last reported to the feeds.
    std::vector<Quality> announced BAUDGATE_GUARDED_BY(mutex);
    Instant next_ageing BAUDGATE_GUARDED_BY(mutex) = Instant::max();
  };

  void Announce(std::uint32_t device, std::span<const std::uint32_t> points);
  static void ScheduleAgeing(Entry& entry, const DeviceRecord& record, std::size_t point,
                             Instant now) BAUDGATE_REQUIRES(entry.mutex);
  std::size_t EndOfDevices(std::uint32_t line) const;

  struct LineEntry {
    LineEntry(std::shared_ptr<const config::Line> its_line, std::uint32_t its_first)
        : first_device(its_first), line(std::move(its_line)) {}
    const std::uint32_t first_device;
    mutable Mutex mutex;
    // Null: a reload has removed the line.
    std::shared_ptr<const config::Line> line BAUDGATE_GUARDED_BY(mutex);
    std::unique_ptr<LineStatus> status BAUDGATE_GUARDED_BY(mutex) =  // null after Forget
        std::make_unique<LineStatus>();
  };

  SteadyVector<Entry> devices_;
  SteadyVector<LineEntry> lines_;
  mutable Mutex feeds_mutex_;
  std::vector<std::shared_ptr<ChangeFeed>> feeds_ BAUDGATE_GUARDED_BY(feeds_mutex_);
};

}  // namespace baudgate::bus
