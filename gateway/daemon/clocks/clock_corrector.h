// `ClockCorrector` corrects the clocks of devices whose options ask for corrections
// (protocols/common/clock.h). It writes to a point as a client named "gateway", through the same
// gate, audit and queue as any client. For each device, once a second:
//
//   1. This machine's clock is right, the hour allows a correction, the last try was 25 hours ago,
//      and clock_drift is good and large enough → clock_drift is read once more, now.
//   2. Both readings agree → the time of the try is written to the disk.
//   3. The time is on the disk → clock_correction is written, or an event says why not.
//
// The next try is 25 hours later, whatever the result, and also after a restart: so it is on
// another day of the device's clock even when summer time ends. A try whose time cannot be written
// to the disk is not made. `HostClock` checks whether this machine's clock is right.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/base/worker.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/records/disk/device_memory.h"
#include "protocols/common/clock.h"

struct sd_bus;

namespace baudgate::daemon {

class ClockCorrector {
 public:
  static constexpr Duration kBetweenTries = std::chrono::hours(25);
  /// The time from a reading that failed, or disagreed with the reading before, to the next
  /// reading.
  static constexpr Duration kBetweenReads = std::chrono::minutes(10);

  struct Links {
    const bus::PointStore& store;
    bus::CommandSink& commands;
    /// Opens the store for the times of correction attempts; called once the configuration of some
    /// device requests corrections. Null: there is no state folder, so no clock is corrected.
    std::function<std::unique_ptr<records::DeviceMemory>(const config::Config&)> open;
    std::function<void(std::uint32_t device, bool corrected, const std::string& text, Now at)> tell;
    std::function<void(const std::string&)> warn;
  };
  /// The targets of `links` must outlive this object.
  explicit ClockCorrector(Links links);

  /// Must be called at the start, and after a reload has given numbers to the devices. New devices
  /// are not checked before this call.
  void OnReload(const config::Config& config);
  void OnHostClock(bool right);
  void Tick(Now now);
  /// Tick does nothing after this call.
  void Stop();

 private:
  struct Answered {
    Mutex mutex;
    std::optional<WriteResult> result BAUDGATE_GUARDED_BY(mutex);
  };
  struct UnderWay {
    enum class Step : std::uint8_t { reads, keeps, writes };
    Step step = Step::reads;
    std::shared_ptr<Answered> answered = std::make_shared<Answered>();
    double drift = 0;  ///< in seconds, from the first reading
    /// Keeps the device in the store until the result of the correction is reported.
    std::shared_ptr<const void> held{};
  };

  void Look(std::uint32_t device, const protocols::ClockCare& care, Now now)
      BAUDGATE_REQUIRES(mutex_);
  void GoOn(std::uint32_t device, const protocols::ClockCare& care, Now now)
      BAUDGATE_REQUIRES(mutex_);
  void Begin(std::uint32_t device, const protocols::ClockCare& care, Now now)
      BAUDGATE_REQUIRES(mutex_);
  void Keep(std::uint32_t device, const protocols::ClockCare& care, double before, Now now)
      BAUDGATE_REQUIRES(mutex_);
  void Correct(std::uint32_t device, const protocols::ClockCare& care, double drift, Now now)
      BAUDGATE_REQUIRES(mutex_);
  void TellEnd(std::uint32_t device, double drift, const WriteResult& result, Now now) const
      BAUDGATE_REQUIRES(mutex_);
  bool MayTry(std::uint32_t device, const protocols::ClockCare& care, Now now) const
      BAUDGATE_REQUIRES(mutex_);
  /// Returns the drift in seconds; nothing if the quality of the drift point is not good.
  std::optional<double> DriftOf(std::uint32_t device, const protocols::ClockCare& care,
                                Instant now) const;

  const Links links_;
  Mutex mutex_;
  bus::WriteGate gate_ BAUDGATE_GUARDED_BY(mutex_);
  // Null: no device asks for corrections, or there is no state folder.
  std::unique_ptr<records::DeviceMemory> tries_ BAUDGATE_GUARDED_BY(mutex_);
  std::uint32_t devices_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  bool right_ BAUDGATE_GUARDED_BY(mutex_) = false;
  bool stopped_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::optional<Instant> looked_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<std::uint32_t, UnderWay> under_way_ BAUDGATE_GUARDED_BY(mutex_);  // key: device
  std::map<std::uint32_t, Instant> not_before_ BAUDGATE_GUARDED_BY(mutex_);  // key: device
};

/// Asks systemd's time service (org.freedesktop.timedate1) over the system bus whether this
/// machine's clock is synchronised. A service with ProtectClock= in its unit must not ask the
/// kernel itself; timedated calls adjtimex for it. Returns nothing without a bus, a service or a
/// reply. Can take some seconds.
std::optional<bool> AskTimeService();
std::optional<bool> AskTimeService(sd_bus& bus);

/// HostClock checks whether this machine's clock is synchronised (NTP, PTP, GPS), and reports every
/// change; devices get the time only from a synchronised clock. The checks run on a separate
/// thread, because a reply can take seconds.
class HostClock {
 public:
  /// `tell` is called on the separate thread when the clock is right for the first time, and at
  /// every change.
  explicit HostClock(std::function<void(bool right)> tell);
  /// Asks the thread to end after the current check; the destructor waits for it.
  void RequestStop() { worker_.RequestStop(); }

 private:
  Duration Look();

  const std::function<void(bool)> tell_;
  bool told_ = false;
  Worker worker_;
};

}  // namespace baudgate::daemon
