// BirthOracle judges each good reading of a run. The value tells from which point, device and time
// it comes. It must belong to this point and to the device at this address, and must not be older
// than its time stamp by more than one poll. The value can be younger, because the time stamp is
// that of the oldest request that the reply could answer. The oracle also measures the share of
// good readings.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gateway/bus/points/point_store.h"
#include "tests/protocols/runs/birth_values.h"

namespace baudgate::protocols {

class BirthOracle {
 public:
  /// `values` are the values of each simulated device ("twin"). At first, twin n answers at the
  /// address of device n.
  BirthOracle(const bus::PointStore& store, std::function<Instant()> clock, const BirthCode& code,
              const std::vector<std::unique_ptr<BirthValues>>& values);

  void Look();

  /// From now on, the simulated device `twin` answers at the address. `foreign`: it is not the
  /// configured device, so its values are never right.
  void Replace(std::uint32_t device, std::size_t twin, bool foreign);
  /// Call this if requests failed before a device of another identity took the address. From now
  /// on, values of the old and of the new device must not be good at the same time.
  void ForbidMixture(std::uint32_t device) { states_[device].no_mixture = true; }
  /// A write of this value was confirmed. From now on, no earlier value of the point must be good.
  void Confirm(std::uint32_t device, std::uint32_t point, double value);

  /// Returns true if the wrong reading of the device could not be detected.
  std::function<bool(std::uint32_t device)> excuse;
  /// A wrong reading is allowed to be good for this long.
  Duration grace{};

  std::size_t judged() const { return judged_; }
  std::size_t wrong() const { return wrong_; }
  std::size_t excused() const { return excused_; }
  /// Describes the first wrong reading: its value, point and time, and from which point and time
  /// the value came.
  const std::string& what() const { return what_; }

  /// Returns the share of good points since RestartAvailability, sampled every 100 ms.
  double Availability() const;
  void RestartAvailability();

 private:
  struct PointState {
    std::uint64_t judged = 0;
    std::size_t twin = 0;
    bool good = false;
    // The time of the latest confirmed write of the point. Values from before this time are wrong.
    Instant must_be_newer{};
    std::uint64_t pending = 0;
    Instant pending_until{};
    std::string pending_what;
  };
  struct DeviceState {
    std::uint64_t version = 0;
    // All simulated devices that have had this address. The last one in the list answers now.
    std::vector<std::size_t> twins;
    std::vector<bool> foreign;  // for each of `twins`
    bool no_mixture = false;
    std::vector<PointState> points;
  };

  void LookAt(std::uint32_t device, const bus::DeviceRecord& record);
  void Judge(std::uint32_t device, std::size_t point, const bus::DeviceRecord& record);
  std::string Whose(std::uint32_t device, const BirthCode::Origin& origin, double value,
                    std::size_t point, const bus::DeviceRecord& record) const;
  void JudgeMixture(std::uint32_t device, const bus::DeviceRecord& record);
  void Blame(std::uint32_t device, std::size_t point, std::uint64_t reading, std::string what);
  void Settle(std::uint32_t device, const bus::DeviceRecord& record);
  std::string Shown(std::uint32_t device, std::size_t point, const bus::DeviceRecord& record) const;
  void Sample();

  const bus::PointStore& store_;
  std::function<Instant()> clock_;
  const BirthCode& code_;
  const std::vector<std::unique_ptr<BirthValues>>& values_;
  std::vector<DeviceState> states_;
  std::size_t judged_ = 0;
  std::size_t wrong_ = 0;
  std::size_t excused_ = 0;
  std::string what_;
  Instant begin_ = clock_();
  Instant next_sample_ = begin_;
  std::size_t samples_ = 0;
  std::size_t good_samples_ = 0;
};

}  // namespace baudgate::protocols
