// The class template `TwinPoints` is a part of twins (simulated devices).
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "config/model/device.h"
#include "gateway/base/result.h"
#include "protocols/twin.h"

namespace baudgate::protocols {

/// Finds the points of a simulated device by their addresses, which it parses once. `Read` and
/// `Written` are the protocol's types for parsed `read` and `write` texts.
template <typename Read, typename Written = Read>
class TwinPoints {
 public:
  struct One {
    std::size_t index = 0;
    const config::Point* point = nullptr;
    std::optional<Read> read;
    std::optional<Written> write;
  };

  /// Parses the addresses of all points. The parsers take a config::Point and return a Result. A
  /// `read` that does not parse makes the point unreadable, a `write` makes it unwritable; the
  /// check of the configuration has reported the error. `device` and `values` must outlive this
  /// object.
  template <typename ParseRead, typename ParseWrite>
  TwinPoints(const config::Device& device, TwinValues& values, ParseRead parse_read,
             ParseWrite parse_write)
      : values_(values) {
    for (const config::Point& point : device.points) {
      One one{all_.size(), &point, {}, {}};
      if (point.access != config::Access::write) one.read = Kept(parse_read(point));
      if (point.access != config::Access::read) one.write = Kept(parse_write(point));
      all_.push_back(std::move(one));
    }
  }

  const std::vector<One>& all() const { return all_; }

  template <typename Matches>
  const One* Find(Matches matches) const {
    for (const One& one : all_) {
      if (one.read && matches(*one.read)) return &one;
    }
    return nullptr;
  }
  template <typename Matches>
  const One* FindWritable(Matches matches) const {
    for (const One& one : all_) {
      if (one.write && matches(*one.write)) return &one;
    }
    return nullptr;
  }

  /// Get and Set use raw values, as in TwinValues.
  Value Get(const One& one, Instant now) const { return values_.Get(one.index, now); }
  void Set(const One& one, const Value& value) { values_.Set(one.index, value); }

 private:
  template <typename T>
  static std::optional<T> Kept(Result<T> parsed) {
    if (!parsed) return std::nullopt;
    return std::move(*parsed);
  }

  TwinValues& values_;
  std::vector<One> all_;
};

}  // namespace baudgate::protocols
