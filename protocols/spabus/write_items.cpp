// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/write_items.h"

#include <algorithm>

#include "protocols/spabus/points.h"
#include "protocols/spabus/values.h"

namespace baudgate::protocols::spabus {
namespace {

/// Whether what its write has set can be told by reading it.
bool IsReadBack(const config::Point& point) {
  return point.access == config::Access::read_write &&
         (point.write.empty() || point.write == point.read);
}

bool IsNext(const Address& item, const Address& before) {
  return item.channel == before.channel && item.category == before.category && item.number &&
         before.number && *item.number == *before.number + 1;
}

/// `>1WS21/23:` and `:CC` CR around the values, with numbers of the greatest length.
constexpr std::size_t kMostAround = 28;

}  // namespace

std::vector<PointValue> ValuesOf(const Task& task) {
  std::vector<PointValue> values = {{task.point, task.value}};
  values.insert(values.end(), task.also.begin(), task.also.end());
  return values;
}

Result<Command> WriteOf(unsigned slave, std::span<const PointValue> values,
                        std::span<const config::Point> points) {
  const auto first = WriteAddress(points[values.front().point]);
  if (!first) return Error{first.error()};
  Command command = WriteOf(slave, *first, {});
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto text = EncodeValue(values[i].value, points[values[i].point]);
    if (!text) return Error{text.error()};
    if (i > 0) command.data += '/';
    command.data += *text;
  }
  if (command.numbers) command.numbers->last += static_cast<std::uint32_t>(values.size() - 1);
  return command;
}

std::size_t CountTogether(std::span<const PointValue> writes, std::span<const config::Point> points,
                          std::size_t most) {
  std::size_t count = 0;
  std::size_t length = kMostAround;
  Address before;
  for (; count < std::min(writes.size(), most); ++count) {
    const config::Point& point = points[writes[count].point];
    const auto item = WriteAddress(point);
    const auto text = EncodeValue(writes[count].value, point);
    if (!item || !text || !IsReadBack(point)) break;
    if (count > 0 && !IsNext(*item, before)) break;
    length += text->size() + 1;
    if (length > kMaxLine) break;
    before = *item;
  }
  return std::max<std::size_t>(count, std::min<std::size_t>(writes.size(), 1));
}

}  // namespace baudgate::protocols::spabus
