// Corrects the clocks of devices whose options want it (protocols/common/clock.h), as a client
// "gateway" that writes to their point: through the same gate, audit and queue as any other. For
// each device, once a second:
//
//   this machine's clock is known to be right, the hour allows it, and the last try is a day ago
//   clock_drift is good and large enough  → it is read once more, now
//   both readings say the same            → that it was tried goes to the disk
//   it is there                           → clock_correction is written, or it is told why not
//
// Whatever becomes of it, also a restart, there is no second try within 25 hours, so that it is
// another day of the device's clock in October, too. A try that cannot be kept is none.
// HostClock tells whether the clock of this machine is right.
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
  /// From one try to the next.
  static constexpr Duration kBetweenTries = std::chrono::hours(25);
  /// From a reading that has failed, or was contradicted, to the next.
  static constexpr Duration kBetweenReads = std::chrono::minutes(10);

  struct Links {
    const bus::PointStore& store;
    bus::CommandSink& commands;
    /// Where tries are kept, made when a device wants it; null: nowhere, and nothing is corrected.
    std::function<std::unique_ptr<records::DeviceMemory>(const config::Config&)> open;
    /// What became of a device's clock.
    std::function<void(std::uint32_t device, bool corrected, const std::string& text, Now at)> tell;
    std::function<void(const std::string&)> warn;
  };
  /// All outlive it.
  explicit ClockCorrector(Links links);

  /// At the start, and when a reload has given the devices numbers: before that the new ones are
  /// not looked at.
  void OnReload(const config::Config& config);
  /// This machine's clock is known to be right, or not any more. From any thread.
  void OnHostClock(bool right);
  /// As often as wanted.
  void Tick(Now now);
  /// Nothing is begun behind it.
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
    double drift = 0;                    ///< seconds, as it was before
    std::shared_ptr<const void> held{};  ///< its end is told also if a reload ends the line
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
  /// The value of the point, where it is good.
  std::optional<double> DriftOf(std::uint32_t device, const protocols::ClockCare& care,
                                Instant now) const;

  const Links links_;
  Mutex mutex_;
  bus::WriteGate gate_ BAUDGATE_GUARDED_BY(mutex_);
  std::unique_ptr<records::DeviceMemory> tries_
      BAUDGATE_GUARDED_BY(mutex_);  // null: nobody wants it
  std::uint32_t devices_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  bool right_ BAUDGATE_GUARDED_BY(mutex_) = false;
  bool stopped_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::optional<Instant> looked_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<std::uint32_t, UnderWay> under_way_ BAUDGATE_GUARDED_BY(mutex_);  // by device
  std::map<std::uint32_t, Instant> not_before_ BAUDGATE_GUARDED_BY(mutex_);  // by device
};

// HostClock tells whether this machine's clock is known to be synchronised (NTP, PTP, GPS), and
// tells every change. Devices are told the time only while it is. HostClock looks now and then, on
// a thread of its own, because the answer may take seconds. AskTimeService asks systemd.

/// Asks systemd's time service (org.freedesktop.timedate1) over the system bus whether this
/// machine's clock is synchronised: for a service that may not ask the kernel (ProtectClock= of the
/// unit). The answer is the kernel's own: timedated calls adjtimex.
/// Empty: there is no bus, no such service, or no answer. May take some seconds.
std::optional<bool> AskTimeService();
/// On a bus that is open.
std::optional<bool> AskTimeService(sd_bus& bus);

class HostClock {
 public:
  /// `tell` hears on the own thread of the first time that it is right, and of every change.
  explicit HostClock(std::function<void(bool right)> tell);
  /// Ends as soon as no answer is under way; the destructor waits for that.
  void RequestStop() { worker_.RequestStop(); }

 private:
  /// Returns until when the answer holds.
  Duration Look();

  const std::function<void(bool)> tell_;
  bool told_ = false;
  Worker worker_;
};

}  // namespace baudgate::daemon
