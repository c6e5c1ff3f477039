// Values that say whose they are and when they were measured: every time that a point of a device
// is read it has another number. So whatever the store shows can be traced to its origin.
//
//   point 3 of twin 1 is slot 13, and this is its 246th reading   →   13 * 1000 + 246 = 13246
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/model/device.h"
#include "protocols/twin.h"

namespace baudgate::protocols {

/// Where a value comes from: the point of this twin had it from `from` up to `to`, or was measured
/// then.
struct Birth {
  std::size_t twin = 0;
  std::size_t point = 0;
  Instant from{};
  Instant to{};
};

/// Between numbers and readings. After how many readings the numbers come again follows from the
/// digits that the protocol has for one: more than a thousand.
class BirthCode {
 public:
  /// `twins`: all that are ever on the line, the points of each; they outlive this.
  BirthCode(std::string_view protocol, std::vector<const config::Device*> twins);

  /// Whether a point has digits enough: a number, neither text nor bit, and not derived.
  static bool CanTell(std::string_view protocol, const config::Point& point);

  Value At(std::size_t twin, std::size_t point, std::uint64_t reading) const;
  struct Origin {
    std::size_t twin = 0;
    std::size_t point = 0;
    std::uint64_t reading = 0;  ///< or so many more: n * readings
    std::uint64_t readings = 0;
  };
  /// The origin of what `shown` shows; nothing: it is nobody's.
  std::optional<Origin> Read(const config::Point& shown, double value) const;
  /// Half the difference between two values of the point.
  double HalfStep(const config::Point& point) const { return ScaleOf(point).step / 2; }

 private:
  struct Scale {
    double first = 0;
    double step = 1;
    std::uint64_t numbers = 0;
  };
  struct Slot {
    std::size_t twin;
    std::size_t point;
  };
  Scale ScaleOf(const config::Point& point) const;

  std::string protocol_;
  std::vector<const config::Device*> twins_;
  std::vector<std::size_t> first_slot_;  // by twin
  std::vector<Slot> slots_;
};

/// What one twin measures: births, and what was written to it ever since it was.
class BirthValues final : public TwinValues {
 public:
  BirthValues(const BirthCode& code, std::size_t twin, std::function<Instant()> clock)
      : code_(code), twin_(twin), clock_(std::move(clock)) {}

  Value Get(std::size_t point, Instant now) const override;
  void Set(std::size_t point, const Value& value) override;

  /// A value that the point has never had: to be written.
  Value Fresh(std::size_t point) { return Next(point, clock_()); }
  /// When the point has had this value, up to `latest`; nothing: never.
  std::optional<Birth> Find(std::size_t point, const config::Point& shown, double value,
                            Instant latest) const;
  /// How often anything was written.
  std::size_t writes() const { return writes_; }

 private:
  struct Written {
    Value value;
    Instant since;
  };
  Value Next(std::size_t point, Instant now) const;

  const BirthCode& code_;
  std::size_t twin_;
  mutable std::map<std::size_t, std::vector<Instant>> readings_;  // by point
  std::function<Instant()> clock_;
  std::map<std::size_t, std::vector<Written>> written_;
  std::size_t writes_ = 0;
};

}  // namespace baudgate::protocols
