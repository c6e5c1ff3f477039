// The latest value of every point with its quality and time, and the status of every device: the
// one meeting place of lines (which write) and outputs (which read). Thread-safe. Each device has
// one lock, so a reader sees a consistent record of a device.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/base/quality.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/bus/points/ageing.h"
#include "gateway/bus/points/change_feed.h"
#include "gateway/bus/points/device_record.h"
#include "gateway/bus/points/device_status.h"
#include "gateway/bus/points/line_status.h"
#include "gateway/bus/points/steady_vector.h"

namespace baudgate {

/// A reading after conversion (gateway/bus/points/conversion.h), ready to store. No value: the last
/// one is kept.
struct Sample {
  std::uint32_t point = 0;
  Value value;
  Quality quality = Quality::good;
};

class PointStore {
 public:
  /// `config` outlives the store. Devices are numbered in the order of the file.
  explicit PointStore(const config::Config& config);

  std::uint32_t device_count() const { return static_cast<std::uint32_t>(devices_.size()); }
  const config::Line& line(std::uint32_t device) const { return *devices_[device].line; }
  const config::Device& device(std::uint32_t device) const { return *devices_[device].device; }
  /// A reload has removed it; its number is not used again.
  bool gone(std::uint32_t device) const { return devices_[device].gone; }
  /// Without those that are gone.
  std::uint32_t present_count() const;

  /// Calls `look` with the device's record under its lock. Keep it short; call nothing of the
  /// store.
  void Read(std::uint32_t device, const std::function<void(const DeviceRecord&)>& look) const;

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

  /// Lines are numbered in the order of the file; `line` is one of the configuration's.
  std::uint32_t LineIndex(const config::Line& line) const;
  LineStatus ReadLine(std::uint32_t line) const;
  /// Changes the status of a line under its lock.
  void UpdateLine(std::uint32_t line, const std::function<void(LineStatus&)>& change);

  /// A feed of everything that changes from now on.
  std::shared_ptr<ChangeFeed> Subscribe();
  void Unsubscribe(const std::shared_ptr<ChangeFeed>& feed);

  // A reload: one thread at a time, while others use the store.

  /// One more line. It and its devices get the next numbers. `line` outlives the store.
  void Append(const config::Line& line);
  /// Gives the line another configuration of the same devices and points. `as` must live as long as
  /// the store; so must the one that it replaces. New age limits hold for old readings as well,
  /// because the user has changed the rule. A value that was too old when SetLineCycle changed the
  /// limits stays so until it is read again.
  void Reconfigure(std::uint32_t line, const config::Line& as);
  /// The devices of this line are no longer polled. What is known of them stays.
  void Retire(std::uint32_t line);

  /// Tells the feeds of points whose quality has changed by age alone since they were last told.
  /// The daemon calls it every 200 ms (gateway/daemon/ticker.h); devices that cannot have aged cost
  /// nothing.
  void Age(Instant now);

 private:
  struct Entry {
    Entry(const config::Line& its_line, const config::Device& its_device);
    std::atomic<const config::Line*> line;
    std::atomic<const config::Device*> device;
    std::atomic<bool> gone = false;
    mutable Mutex mutex;
    DeviceRecord record BAUDGATE_GUARDED_BY(mutex);
    /// The qualities that the feeds were last told of.
    std::vector<Quality> announced BAUDGATE_GUARDED_BY(mutex);
    Instant next_ageing BAUDGATE_GUARDED_BY(mutex) = Instant::max();
  };

  void Announce(std::uint32_t device, std::span<const std::uint32_t> points);
  static void ScheduleAgeing(Entry& entry, std::size_t point, Instant now)
      BAUDGATE_REQUIRES(entry.mutex);

  struct LineEntry {
    LineEntry(const config::Line& its_line, std::uint32_t its_first)
        : line(&its_line), first_device(its_first) {}
    std::atomic<const config::Line*> line;  // as it was appended; null: it is gone
    const std::uint32_t first_device;
    mutable Mutex mutex;
    LineStatus status BAUDGATE_GUARDED_BY(mutex);
  };

  SteadyVector<Entry> devices_;
  SteadyVector<LineEntry> lines_;
  mutable Mutex feeds_mutex_;
  std::vector<std::shared_ptr<ChangeFeed>> feeds_ BAUDGATE_GUARDED_BY(feeds_mutex_);
};

}  // namespace baudgate
