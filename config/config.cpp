// SPDX-License-Identifier: Apache-2.0
#include "config/config.h"

#include <algorithm>
#include <limits>

namespace baudgate::config {
namespace {

template <typename T>
constexpr IntegerRange RangeOf() {
  return {static_cast<std::int64_t>(std::numeric_limits<T>::min()),
          static_cast<std::uint64_t>(std::numeric_limits<T>::max())};
}

std::string HostAndPort(const std::string& host, std::uint16_t port) {
  const bool is_v6 = host.find(':') != std::string::npos;
  return (is_v6 ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

}  // namespace

std::string Mark::ToString() const {
  return file + ":" + std::to_string(line) + ":" + std::to_string(column);
}

std::string SerialSettings::ToString() const {
  const char letter = parity == Parity::none ? 'N' : parity == Parity::even ? 'E' : 'O';
  return std::to_string(baud) + " " + std::to_string(data_bits) + letter +
         std::to_string(stop_bits);
}

Timing Merge(const Timing& first, const Timing& second) {
  Timing merged = first;
  if (!merged.quiet) merged.quiet = second.quiet;
  if (!merged.reply) merged.reply = second.reply;
  if (!merged.gap) merged.gap = second.gap;
  if (!merged.ceiling) merged.ceiling = second.ceiling;
  if (!merged.drain) merged.drain = second.drain;
  return merged;
}

Timing Resolve(const Timing& given, const Timing& fallback) {
  Timing timing = Merge(given, fallback);
  if (given.reply && !given.ceiling) {
    timing.ceiling = *fallback.ceiling + *given.reply - *fallback.reply;
  }
  timing.ceiling = std::max(*timing.ceiling, *timing.reply + *timing.gap);
  return timing;
}

Pace Merge(const Pace& first, const Pace& second) {
  Pace merged = first;
  merged.timing = Merge(first.timing, second.timing);
  if (!merged.retries) merged.retries = second.retries;
  if (!merged.poll) merged.poll = second.poll;
  if (!merged.slow) merged.slow = second.slow;
  return merged;
}

std::string_view Name(Type type) {
  switch (type) {
    case Type::boolean:
      return "bool";
    case Type::int16:
      return "int16";
    case Type::uint16:
      return "uint16";
    case Type::int32:
      return "int32";
    case Type::uint32:
      return "uint32";
    case Type::int64:
      return "int64";
    case Type::uint64:
      return "uint64";
    case Type::float32:
      return "float32";
    case Type::float64:
      return "float64";
    case Type::string:
      return "string";
  }
  return "float32";
}

std::string_view Name(Group group) {
  switch (group) {
    case Group::once:
      return "once";
    case Group::slow:
      return "slow";
    case Group::fast:
      return "fast";
  }
  return "fast";
}

std::string_view Name(Access access) {
  switch (access) {
    case Access::read:
      return "r";
    case Access::write:
      return "w";
    case Access::read_write:
      return "rw";
  }
  return "r";
}

std::string_view Name(WordOrder order) {
  switch (order) {
    case WordOrder::abcd:
      return "ABCD";
    case WordOrder::cdab:
      return "CDAB";
    case WordOrder::badc:
      return "BADC";
    case WordOrder::dcba:
      return "DCBA";
  }
  return "ABCD";
}

std::string_view Name(Priority priority) {
  switch (priority) {
    case Priority::low:
      return "low";
    case Priority::normal:
      return "normal";
    case Priority::high:
      return "high";
  }
  return "normal";
}

std::string_view Name(Permit permit) {
  switch (permit) {
    case Permit::read:
      return "read";
    case Permit::data:
      return "data";
    case Permit::all:
      return "all";
  }
  return "all";
}

std::string Listener::Place() const { return is_serial() ? path : HostAndPort(host, port); }

std::uint8_t Route::SlaveOf(std::uint8_t unit) const {
  return remap ? static_cast<std::uint8_t>(*remap + (unit - first)) : unit;
}

std::string Route::Units() const {
  return first == last ? std::to_string(first) : std::to_string(first) + "-" + std::to_string(last);
}

std::string Route::Target() const {
  return line.empty() ? "server " + HostAndPort(host, port) : "line " + line;
}

std::size_t RegisterCount(const Point& point) {
  switch (point.type) {
    case Type::boolean:
    case Type::int16:
    case Type::uint16:
      return 1;
    case Type::int32:
    case Type::uint32:
    case Type::float32:
      return 2;
    case Type::int64:
    case Type::uint64:
    case Type::float64:
      return 4;
    case Type::string:
      return (point.text_length + 1) / 2;
  }
  return 1;
}

bool IntegerRange::Contains(double whole) const {
  return whole >= static_cast<double>(lowest) && whole < static_cast<double>(highest) + 1;
}

IntegerRange RangeOf(Type type) {
  switch (type) {
    case Type::boolean:
      return {0, 1};
    case Type::int16:
      return RangeOf<std::int16_t>();
    case Type::uint16:
      return RangeOf<std::uint16_t>();
    case Type::int32:
      return RangeOf<std::int32_t>();
    case Type::uint32:
      return RangeOf<std::uint32_t>();
    case Type::int64:
      return RangeOf<std::int64_t>();
    case Type::uint64:
      return RangeOf<std::uint64_t>();
    case Type::float32:
    case Type::float64:
    case Type::string:
      break;
  }
  return {};
}

}  // namespace baudgate::config
