// Judges every good reading of a run: is it of this point, of the device that the address belongs
// to, and not older than its time stamp says by more than one poll? It may be younger: a stamp is
// that of the oldest request that the reply may belong to. Beside it, how large the share
// of good readings is. Bad and uncertain readings are not judged.
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
  /// `values`: of every twin of the line; device n of the line is twin n at first.
  BirthOracle(const bus::PointStore& store, std::function<Instant()> clock, const BirthCode& code,
              const std::vector<std::unique_ptr<BirthValues>>& values);

  /// After every event, or as often as can be.
  void Look();

  /// From now on the twin answers at the device's address. `foreign`: it is another than the
  /// configuration demands, and never right.
  void Replace(std::uint32_t device, std::size_t twin, bool foreign);
  /// The replaced device was missed by the master and has another identity: from now on values of
  /// both are never good together.
  void ForbidMixture(std::uint32_t device) { states_[device].no_mixture = true; }
  /// The write of this value was confirmed: from now on no earlier value of the point is good.
  void Confirm(std::uint32_t device, std::uint32_t point, double value);

  /// Says of a wrong reading of the device whether nobody could have known.
  std::function<bool(std::uint32_t device)> excuse;
  /// Wrong readings may be good for so long: until what belies them comes.
  Duration grace{};

  std::size_t judged() const { return judged_; }
  std::size_t wrong() const { return wrong_; }
  std::size_t excused() const { return excused_; }
  /// The first wrong reading: what was shown where and when, and whose it is.
  const std::string& what() const { return what_; }

  /// Share of points that are good, sampled every 100 ms from the last Restart on.
  double Availability() const;
  void RestartAvailability();

 private:
  struct PointState {
    std::uint64_t judged = 0;   // the last reading that was
    std::size_t twin = 0;       // whose value it is
    bool good = false;          // at the last look
    Instant must_be_newer{};    // than a write that was confirmed
    std::uint64_t pending = 0;  // the wrong reading that has grace,
    Instant pending_until{};    // until then
    std::string pending_what;
  };
  struct DeviceState {
    std::uint64_t version = 0;
    std::vector<std::size_t> twins;  // the last one answers now
    std::vector<bool> foreign;       // of each
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
