// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/runs/birth_oracle.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "gateway/bus/points/point_store.h"

namespace baudgate::protocols {
namespace {

constexpr Duration kSampling = 100ms;

std::string Seconds(Duration time) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.2fs", static_cast<double>(time / 1ms) / 1000);
  return text.data();
}

Duration PeriodOf(const config::Device& device, std::size_t point) {
  return device.points[point].group == config::Group::slow ? device.slow : device.poll;
}

}  // namespace

BirthOracle::BirthOracle(const bus::PointStore& store, std::function<Instant()> clock,
                         const BirthCode& code,
                         const std::vector<std::unique_ptr<BirthValues>>& values)
    : store_(store), clock_(std::move(clock)), code_(code), values_(values) {
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    states_.emplace_back();
    states_.back().twins = {device};
    states_.back().foreign = {false};
    states_.back().points.resize(store.point_count(device));
  }
}

void BirthOracle::Look() {
  Sample();
  for (std::uint32_t device = 0; device < states_.size(); ++device) {
    store_.Read(device, [&](const bus::DeviceRecord& record) { LookAt(device, record); });
  }
}

void BirthOracle::LookAt(std::uint32_t device, const bus::DeviceRecord& record) {
  DeviceState& state = states_[device];
  if (grace > Duration::zero()) Settle(device, record);
  if (std::exchange(state.version, record.version) == record.version) return;
  const Instant now = clock_();
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    PointState& point = state.points[i];
    point.good = IsGood(QualityAt(record, i, now));
    if (point.good) Judge(device, i, record);
  }
  if (state.no_mixture) JudgeMixture(device, record);
}

void BirthOracle::Judge(std::uint32_t device, std::size_t i, const bus::DeviceRecord& record) {
  DeviceState& state = states_[device];
  PointState& point = state.points[i];
  const bus::PointRecord& held = record.points[i];
  const config::Point& config = record.device->points[i];
  const double value = ToDouble(held.value);
  if (point.judged == held.seq && point.must_be_newer == Instant()) return;
  std::optional<Birth> birth;
  for (const std::size_t twin : state.twins) {
    auto one = values_[twin]->Find(i, config, value, clock_());
    if (one && (!birth || one->to > birth->to)) birth = one;
  }
  const bool again = std::exchange(point.judged, held.seq) == held.seq;
  if (birth) point.twin = birth->twin;
  if (birth && birth->to <= point.must_be_newer) {
    return Blame(device, i, held.seq,
                 Shown(device, i, record) + ", the value before the write that was confirmed");
  }
  if (again) return;
  ++judged_;
  if (!birth) {
    const auto origin = code_.Read(config, value);
    const std::string whose = origin ? Whose(device, *origin, value, i, record) : "nobody's value";
    return Blame(device, i, held.seq, Shown(device, i, record) + ": " + whose);
  }
  const auto holder = std::ranges::find(state.twins, birth->twin) - state.twins.begin();
  if (state.foreign[static_cast<std::size_t>(holder)]) {
    return Blame(device, i, held.seq,
                 Shown(device, i, record) + ": of a device whose identity is not the demanded one");
  }
  const Duration older = *held.read_at - birth->to;
  const Duration poll = PeriodOf(*record.device, i);
  if (older <= poll) return;
  Blame(device, i, held.seq,
        Shown(device, i, record) + ": it is " + Seconds(older) +
            " older than its stamp, a poll is " + Seconds(poll));
}

std::string BirthOracle::Whose(std::uint32_t device, const BirthCode::Origin& origin, double value,
                               std::size_t i, const bus::DeviceRecord& record) const {
  const Instant stamp = *record.points[i].read_at;
  const config::Point& config = record.device->points[i];
  const auto birth = values_[origin.twin]->Find(origin.point, config, value, clock_());
  if (!birth) return "nobody's value";
  const std::vector<std::size_t>& twins = states_[device].twins;
  const bool here = std::ranges::find(twins, origin.twin) != twins.end();
  return "the value of twin " + std::to_string(origin.twin) +
         (here ? "" : ", which has another address") + ", point " + std::to_string(origin.point) +
         " (this one is " + std::to_string(i) + "), " + Seconds(stamp - birth->from) +
         " before its stamp";
}

void BirthOracle::JudgeMixture(std::uint32_t device, const bus::DeviceRecord& record) {
  DeviceState& state = states_[device];
  const auto is_new = [&](const PointState& point) { return point.twin == state.twins.back(); };
  const bool replaced = std::ranges::any_of(
      state.points, [&](const PointState& point) { return point.good && is_new(point); });
  if (!replaced) return;
  for (std::size_t i = 0; i < state.points.size(); ++i) {
    if (!state.points[i].good || is_new(state.points[i])) continue;
    state.no_mixture = false;
    return Blame(
        device, i, record.points[i].seq,
        Shown(device, i, record) + ": of the replaced device, beside values of the new one");
  }
}

void BirthOracle::Blame(std::uint32_t device, std::size_t i, std::uint64_t reading,
                        std::string what) {
  PointState& point = states_[device].points[i];
  if (wrong_ == 0 && excuse && excuse(device)) {
    ++excused_;
    return;
  }
  if (grace > Duration::zero()) {
    point.pending = reading;
    point.pending_until = clock_() + grace;
    point.pending_what = std::move(what);
    return;
  }
  point.must_be_newer = {};
  if (wrong_++ == 0) what_ = std::move(what);
}

void BirthOracle::Settle(std::uint32_t device, const bus::DeviceRecord& record) {
  const Instant now = clock_();
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    PointState& point = states_[device].points[i];
    if (point.pending == 0) continue;
    const bool still = record.points[i].seq == point.pending && IsGood(QualityAt(record, i, now));
    if (!still) {
      ++excused_;
    } else if (now > point.pending_until) {
      if (wrong_++ == 0) what_ = point.pending_what + "; good for longer than the truth took";
    } else {
      continue;
    }
    point.pending = 0;
  }
}

std::string BirthOracle::Shown(std::uint32_t device, std::size_t i,
                               const bus::DeviceRecord& record) const {
  const bus::PointRecord& held = record.points[i];
  return "after " + Seconds(clock_() - begin_) + " " + record.device->name + " " +
         record.device->points[i].name + " shows " + ToText(held.value) + " (good, aged " +
         Seconds(clock_() - *held.read_at) + ", device " + std::to_string(device) + ")";
}

void BirthOracle::Replace(std::uint32_t device, std::size_t twin, bool foreign) {
  states_[device].twins.push_back(twin);
  states_[device].foreign.push_back(foreign);
  states_[device].no_mixture = false;
}

void BirthOracle::Confirm(std::uint32_t device, std::uint32_t i, double value) {
  const auto its = store_.device(device);
  const config::Point& config = its->points[i];
  const Instant now = clock_();
  for (const std::size_t twin : states_[device].twins) {
    const auto birth = values_[twin]->Find(i, config, value, now);
    if (!birth) continue;
    states_[device].points[i].must_be_newer = birth->from;
    states_[device].version = 0;
  }
}

void BirthOracle::Sample() {
  const Instant now = clock_();
  for (; next_sample_ <= now; next_sample_ += kSampling) {
    for (std::uint32_t device = 0; device < states_.size(); ++device) {
      store_.Read(device, [&](const bus::DeviceRecord& record) {
        for (std::size_t i = 0; i < record.points.size(); ++i) {
          ++samples_;
          if (IsGood(QualityAt(record, i, next_sample_))) ++good_samples_;
        }
      });
    }
  }
}

double BirthOracle::Availability() const {
  return samples_ == 0 ? 0 : static_cast<double>(good_samples_) / static_cast<double>(samples_);
}

void BirthOracle::RestartAvailability() {
  next_sample_ = clock_();
  samples_ = good_samples_ = 0;
}

}  // namespace baudgate::protocols
