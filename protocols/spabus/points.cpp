// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/points.h"

#include "gateway/base/leading_zero.h"
#include "protocols/spabus/clock_messages.h"
#include "protocols/spabus/clock_offset.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {
namespace {

constexpr DecoderSpec kDecoders[] = {
    {"I1", "input data: measurements and digital inputs"},
    {"O1", "output data: starts, trips and relay outputs"},
    {"S1", "setting"},
    {"V1", "variable: recorded values, counters, control parameters"},
    {"M1", "memory data"},
    {"14V1", "item of channel 14; channel 0 may be left out"},
    {"C", "module status: 0 normal, 1 automatic reset, 2 event overflow, 3 both"},
    {"F", "type designation (string)"},
    {"T", "time within the minute, ss.sss"},
    {"T offset", "how far the device's clock is ahead of this machine's, in s; read only"},
    {"D", "date and time (string)"},
    {"3A", "alarms of a channel (string)"},
};

/// What must not be written through a gateway, and why; nothing = it may be.
std::string_view Forbidden(const Address& address) {
  if (address.category != 'V') return {};
  switch (address.number.value_or(0)) {
    case 160:
    case 161:
      return "it is the password: set the option `password`, writes then use it by themselves";
    case 167:
      return "it formats the memory of the device";
    case 200:
      return "it changes the slave number and would make the device unreachable";
    case 201:
      return "it changes the bit rate and would make the device unreachable";
    default:
      return {};
  }
}

Status CheckOffset(const config::Point& point) {
  if (point.access != config::Access::read) {
    return Error{"'" + point.read + "' can only be read; the clock is set with send_seconds"};
  }
  const bool is_float = point.type == config::Type::float32 || point.type == config::Type::float64;
  if (!is_float) return Error{"'" + point.read + "' is a number of seconds: use type float32"};
  return {};
}

Status CheckRead(const config::Point& point) {
  if (point.read == kOffsetItem) return CheckOffset(point);
  const auto address = ParseAddress(point.read);
  if (!address) return Error{address.error()};
  const char category = address->category;
  if (category == 'L' || category == 'B') {
    return Error{"'" + point.read +
                 "' reads events, and reading takes them out of the device; "
                 "events are not points"};
  }
  const bool text = category == 'F' || category == 'D' || category == 'A';
  if (text && point.type != config::Type::string) {
    return Error{"'" + point.read + "' is text: use type string(16)"};
  }
  const std::uint32_t number = address->number.value_or(0);
  if (category == 'V' && number >= kPasswordItems.first && number <= kPasswordItems.last) {
    return Error{"'" + point.read + "' is the password and cannot be read"};
  }
  return {};
}

Status CheckWrite(const config::Point& point) {
  const std::string& text = point.write.empty() ? point.read : point.write;
  const auto address = WriteAddress(point);
  if (!address) return Error{address.error()};
  constexpr std::string_view kWritable = "OSVMCTD";
  if (kWritable.find(address->category) == std::string_view::npos) {
    return Error{"'" + text + "' can only be read; the categories to write are O S V M C T D"};
  }
  const std::string_view why = Forbidden(*address);
  if (!why.empty()) {
    return Error{"'" + text + "' cannot be written through the gateway: " + std::string(why)};
  }
  return {};
}

}  // namespace

Result<Address> WriteAddress(const config::Point& point) {
  return ParseAddress(point.write.empty() ? point.read : point.write);
}

std::vector<ReadPoint> ReadablePoints(std::span<const config::Point> points) {
  std::vector<ReadPoint> readable;
  for (std::size_t index = 0; index < points.size(); ++index) {
    const config::Point& point = points[index];
    if (point.access == config::Access::write) continue;
    if (point.read == kOffsetItem) {
      readable.push_back({{0, kSeconds, std::nullopt}, index, &point, true});
    } else if (const auto address = ParseAddress(point.read)) {
      readable.push_back({*address, index, &point});
    }
  }
  return readable;
}

std::vector<Doubt> DoubtsOf(const config::Device& device) {
  std::vector<Doubt> doubts;
  if (const auto slave = ParseSlave(device.address); slave && *slave > kBroadcast) {
    doubts.push_back({kNoPoint, std::to_string(*slave) +
                                    " lies beyond the broadcast number 900, which no known device "
                                    "can have; write the number that the device shows, 1 to 899"});
  }
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    const config::Point& point = device.points[i];
    if (!point.writing.allowed) continue;
    const auto item = WriteAddress(point);
    if (!item || item->category != 'O') continue;
    doubts.push_back({i, "can be written: " + FormatAddress(*item) +
                             " is an output of a protection relay, and whoever may write to it may "
                             "trip a breaker; name only the needed points in `write` of the "
                             "device, and set permit: read at listeners that need not write"});
  }
  return doubts;
}

Status CheckPoint(const config::Point& point) {
  for (const std::string& text : {point.read, point.write}) {
    if (const Status status = RefuseLeadingZeros(text, "^IOSVM"); !status) return status;
  }
  if (point.access != config::Access::write || !point.read.empty()) {
    if (Status read = CheckRead(point); !read) return read;
  }
  if (point.table == config::Table::bits && point.type != config::Type::boolean) {
    return Error{"'" + point.name + "' stands in a bit table: use type bool"};
  }
  if (point.access == config::Access::read) return {};
  return CheckWrite(point);
}

std::span<const DecoderSpec> DecoderTable() { return kDecoders; }

}  // namespace baudgate::protocols::spabus
