// The latest value of every point with its quality and time, and the status of every device and
// line: the one meeting place of lines (which write) and outputs (which read). Thread-safe. Each
// device has one lock, so a reader sees a consistent record of a device. ChangeFeed tells an output
// what has changed, and AgedQuality makes a quality worse by age. readings.h has the way of a
// reading to the store.
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

// The narrow way from the point store to an output: which points and devices have changed since the
// output last looked. Coalescing: a slow output sees the latest state of each, never a backlog, and
// memory is bounded by the number of points. Filled by line threads, drained by the output's
// thread.
struct PointRef {
  std::uint32_t device = 0;  ///< index in the point store
  std::uint32_t point = 0;   ///< index in the device's points
};

struct Changes {
  std::vector<PointRef> points;
  std::vector<std::uint32_t> devices;  ///< whose state or counters changed

  bool empty() const { return points.empty() && devices.empty(); }
};

class ChangeFeed {
 public:
  /// points_per_device[d] is the number of points of device d.
  explicit ChangeFeed(std::span<const std::size_t> points_per_device);

  /// One more device.
  void AddDevice(std::size_t points);

  void MarkPoints(std::uint32_t device, std::span<const std::uint32_t> points);
  void MarkDevice(std::uint32_t device);

  /// Takes all that is pending into `out` (which is cleared first). Waits for the first change, at
  /// most until the given time. Also returns, possibly empty, after Wake.
  void Drain(Instant until, Changes& out);
  /// Ends a waiting Drain at once, for an orderly stop.
  void Wake();

 private:
  Mutex mutex_;
  std::condition_variable changed_;
  Changes pending_ BAUDGATE_GUARDED_BY(mutex_);
  std::vector<std::vector<bool>> point_pending_ BAUDGATE_GUARDED_BY(mutex_);
  std::vector<bool> device_pending_ BAUDGATE_GUARDED_BY(mutex_);
  bool woken_ BAUDGATE_GUARDED_BY(mutex_) = false;
};

// What the point store holds of a device: the latest reading of every point, the device's status,
// and from which ages its values are doubted. AgedQuality derives the quality.
struct PointRecord {
  Value value;                              ///< the last that was not bad; empty before the first
  Quality reported = Quality::bad_waiting;  ///< as the last reading said, before age and state
  Quality at_best = Quality::good;  ///< limit until the next reading: it was doubted or too old
  /// The end of the reply, monotonic. Earlier after a late one: such a value is as old as its
  /// request.
  std::optional<Instant> read_at;
  WallTime source_time{};    ///< the same, civil
  std::uint64_t seq = 0;     ///< counts the readings of this point
  std::uint32_t rtt_us = 0;  ///< round trip of the exchange that read it
};

/// For the values of one group.
struct AgeLimits {
  static constexpr Duration kNever = Duration::max();
  Duration uncertain_after = kNever;
  Duration bad_after = kNever;

  bool ages() const { return uncertain_after != kNever; }
  bool operator==(const AgeLimits&) const = default;
};

/// The quality of all values of a device, whatever their age; empty: each has its own.
using Override = std::optional<Quality>;

struct DeviceRecord {
  std::shared_ptr<const config::Line> line;
  std::shared_ptr<const config::Device> device;  ///< a part of `line`
  std::vector<PointRecord> points;               ///< as device->points
  DeviceStatus status;
  Override override_quality;
  Duration line_cycle{};  ///< measured: the line reads all its fast points once in this time
  std::array<AgeLimits, config::kGroups> age_limits;  ///< by config::Group
  /// Raised with every reading, override and age limit: while it stays, only age changes a quality.
  std::uint64_t version = 0;
};

// How good a stored value is at a moment: what the last reading said, made worse by doubt, by age
// and by the state of device and line. Pure; the point store has the records.

/// By config::Group. `line_cycle`: the measured time that the line needs to read all its fast
/// points once; no value is too old before two of them.
std::array<AgeLimits, config::kGroups> LimitsOf(const config::Device& device, Duration line_cycle);

/// What the last reading said, made worse by doubt and age; the state of device and line left out.
Quality AgedQuality(const DeviceRecord& record, std::size_t point, Instant now);

/// In this order of precedence: out of service, line down, device offline, another
/// device than it should be, never read, reported trouble, then age.
Quality QualityAt(const DeviceRecord& record, std::size_t point, Instant now);

/// Since the reading; empty before the first.
std::optional<Duration> AgeAt(const DeviceRecord& record, std::size_t point, Instant now);

/// When age alone changes the point's quality next, seen from `now`; empty: never.
std::optional<Instant> NextAgeing(const DeviceRecord& record, std::size_t point, Instant now);

class PointStore {
 public:
  /// Copies the lines of `config`. Devices are numbered in the order of the file.
  explicit PointStore(const config::Config& config);

  std::uint32_t device_count() const { return static_cast<std::uint32_t>(devices_.size()); }
  /// The configuration as it is now; a reload may replace it. Null: the device is forgotten.
  std::shared_ptr<const config::Line> line(std::uint32_t device) const;
  std::shared_ptr<const config::Device> device(std::uint32_t device) const;
  /// The number of points of the device, also when the device is forgotten.
  std::size_t point_count(std::uint32_t device) const { return devices_[device].point_count; }
  /// A reload has removed it; its number is not used again.
  bool gone(std::uint32_t device) const { return devices_[device].gone; }
  /// Without those that are gone.
  std::uint32_t present_count() const;

  /// Calls `look` with the device's record under its lock. Keep it short; call nothing of the
  /// store. False: the device is forgotten, and `look` is not called.
  bool Read(std::uint32_t device, const std::function<void(const DeviceRecord&)>& look) const;
  /// The device is not forgotten before this is freed. Null: it is forgotten already.
  std::shared_ptr<const void> Hold(std::uint32_t device) const;

  /// Points that were read in one exchange. `at`: see PointRecord::read_at.
  void Update(std::uint32_t device, std::span<const Sample> samples, Now at, Duration round_trip);
  /// The good ones of these points become uncertain until they are read again; values and ages
  /// stay.
  void Doubt(std::uint32_t device, std::span<const std::size_t> points, Instant now);
  void SetOverride(std::uint32_t device, Override why);
  /// The measured time that the line needs to read all its fast points once. The limits of ages
  /// follow it; a value that is too old when they change stays so until it is read again.
  void SetLineCycle(std::uint32_t device, Duration cycle, Instant now);
  /// Changes the status under the lock and tells the feeds.
  void UpdateStatus(std::uint32_t device, const std::function<void(DeviceStatus&)>& change);

  /// Lines are numbered in the order of the file. The present line of this name.
  std::uint32_t LineIndex(const config::Line& line) const;
  /// As it was appended. Null: it is gone.
  std::shared_ptr<const config::Line> LineAt(std::uint32_t line) const;
  /// The status of a line. A line that is forgotten has the status of a new line.
  LineStatus ReadLine(std::uint32_t line) const;
  /// Changes the status of a line under its lock, if it is not forgotten.
  void UpdateLine(std::uint32_t line, const std::function<void(LineStatus&)>& change);

  /// A feed of everything that changes from now on.
  std::shared_ptr<ChangeFeed> Subscribe();
  void Unsubscribe(const std::shared_ptr<ChangeFeed>& feed);

  // A reload: one thread at a time, while others use the store.

  /// One more line. It and its devices get the next numbers.
  void Append(const std::shared_ptr<const config::Line>& line);
  /// Gives the line another configuration of the same devices and points. New age limits hold for
  /// old readings as well, because the user has changed the rule. A value that was too old when
  /// SetLineCycle changed the limits stays so until it is read again.
  void Reconfigure(std::uint32_t line, const std::shared_ptr<const config::Line>& as);
  /// The devices of this line are no longer polled. What is known of them stays until Forget.
  void Retire(std::uint32_t line);
  /// Frees what is known of a retired line, once outputs have other devices: status, readings and
  /// configuration. What is held (Hold) stays as long. Changes to it do nothing from now on.
  void Forget(std::uint32_t line);

  /// Tells the feeds of points whose quality has changed by age alone since they were last told.
  /// The daemon calls it every 200 ms (gateway/daemon/ticker.h); devices that cannot have aged cost
  /// nothing.
  void Age(Instant now);

 private:
  struct Entry {
    Entry(const std::shared_ptr<const config::Line>& line, const config::Device& device);
    const std::size_t point_count;
    // As in the record, but read without its lock: also from within Read.
    std::atomic<std::weak_ptr<const config::Line>> line;
    std::atomic<std::weak_ptr<const config::Device>> device;
    std::atomic<bool> gone = false;
    mutable Mutex mutex;
    std::shared_ptr<DeviceRecord> own BAUDGATE_GUARDED_BY(mutex);  // null after Forget
    std::weak_ptr<DeviceRecord> record BAUDGATE_GUARDED_BY(mutex);
    /// The qualities that the feeds were last told of.
    std::vector<Quality> announced BAUDGATE_GUARDED_BY(mutex);
    Instant next_ageing BAUDGATE_GUARDED_BY(mutex) = Instant::max();
  };

  void Announce(std::uint32_t device, std::span<const std::uint32_t> points);
  static void ScheduleAgeing(Entry& entry, const DeviceRecord& record, std::size_t point,
                             Instant now) BAUDGATE_REQUIRES(entry.mutex);
  /// The number behind that of the line's last device.
  std::size_t EndOfDevices(std::uint32_t line) const;

  struct LineEntry {
    LineEntry(std::shared_ptr<const config::Line> its_line, std::uint32_t its_first)
        : first_device(its_first), line(std::move(its_line)) {}
    const std::uint32_t first_device;
    mutable Mutex mutex;
    std::shared_ptr<const config::Line> line BAUDGATE_GUARDED_BY(mutex);  // null: it is gone
    std::unique_ptr<LineStatus> status BAUDGATE_GUARDED_BY(mutex) =       // null after Forget
        std::make_unique<LineStatus>();
  };

  SteadyVector<Entry> devices_;
  SteadyVector<LineEntry> lines_;
  mutable Mutex feeds_mutex_;
  std::vector<std::shared_ptr<ChangeFeed>> feeds_ BAUDGATE_GUARDED_BY(feeds_mutex_);
};

}  // namespace baudgate::bus
