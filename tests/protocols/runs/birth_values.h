// BirthValues gives each reading of a point a different number, which identifies the twin
// (simulated device), the point and the time of measurement. So the number tells from where any
// value in the store comes.
//
//   point 3 of twin 1 is slot 13, and this is its 246th reading   →   13 * 1000 + 246 = 13246
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

struct Birth {
  std::size_t twin = 0;
  std::size_t point = 0;
  Instant from{};
  Instant to{};
};

/// Converts between readings and numbers, which repeat after more than a thousand readings.
class BirthCode {
 public:
  /// `twins`: the devices of all twins of the run. They must outlive this object.
  BirthCode(std::string_view protocol, std::vector<const config::Device*> twins);

  /// True if the point is a number with enough digits for the code, and not derived.
  static bool CanTell(std::string_view protocol, const config::Point& point);

  Value At(std::size_t twin, std::size_t point, std::uint64_t reading) const;
  struct Origin {
    std::size_t twin = 0;
    std::size_t point = 0;
    /// Number of the reading, or this number plus a multiple of `readings`.
    std::uint64_t reading = 0;
    std::uint64_t readings = 0;
  };
  /// Returns the twin, the point and the reading that gave `value`. `shown` is the point that shows
  /// the value. Returns nothing if no reading has such a value.
  std::optional<Origin> Read(const config::Point& shown, double value) const;
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
  std::vector<std::size_t> first_slot_;
  std::vector<Slot> slots_;
};

/// The values of one simulated device: readings by number, and written values from their write on.
class BirthValues final : public TwinValues {
 public:
  BirthValues(const BirthCode& code, std::size_t twin, std::function<Instant()> clock)
      : code_(code), twin_(twin), clock_(std::move(clock)) {}

  Value Get(std::size_t point, Instant now) const override;
  void Set(std::size_t point, const Value& value) override;

  Value Fresh(std::size_t point) { return Next(point, clock_()); }
  /// Returns when the point had this value, up to `latest`; nothing: it never had this value.
  std::optional<Birth> Find(std::size_t point, const config::Point& shown, double value,
                            Instant latest) const;
  std::size_t writes() const { return writes_; }

 private:
  struct Written {
    Value value;
    Instant since;
  };
  Value Next(std::size_t point, Instant now) const;

  const BirthCode& code_;
  std::size_t twin_;
  mutable std::map<std::size_t, std::vector<Instant>> readings_;
  std::function<Instant()> clock_;
  std::map<std::size_t, std::vector<Written>> written_;
  std::size_t writes_ = 0;
};

}  // namespace baudgate::protocols
