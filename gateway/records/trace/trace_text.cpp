// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/trace/trace_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace baudgate::records {
namespace {

std::string ClockText(WallTime at) {
  const auto day = std::chrono::floor<std::chrono::days>(at);
  const std::chrono::hh_mm_ss clock(std::chrono::floor<std::chrono::microseconds>(at - day));
  return fmt::format("{:02}:{:02}:{:02}.{:06}", clock.hours().count(), clock.minutes().count(),
                     clock.seconds().count(), clock.subseconds().count());
}

std::string EndText(const TraceRecord& record) {
  std::string text = fmt::format("= {}", Name(record.outcome));
  if (record.round_trip > Duration::zero()) {
    text += fmt::format(", {:.1f} ms", static_cast<double>(record.round_trip.count()) / 1e6);
  }
  if (!record.text.empty()) text += ": " + record.text;
  return text;
}

}  // namespace

std::string ToText(const TraceRecord& record) {
  const std::string head =
      ClockText(record.at) + " " + (record.device.empty() ? "-" : record.device) + " ";
  switch (record.kind) {
    case TraceRecord::Kind::sent:
      return head + "> " + record.hex + " | " + record.text;
    case TraceRecord::Kind::received:
      return head + "< " + record.hex + " | " + record.text;
    case TraceRecord::Kind::end:
      return head + EndText(record);
    case TraceRecord::Kind::note:
      break;
  }
  return head + "# " + record.text;
}

void TraceQueue::Push(const TraceRecord& record) {
  bool was_empty = false;
  {
    const MutexLock lock(mutex_);
    if (records_.size() >= kMostRecords) {
      ++dropped_;
      return;
    }
    was_empty = records_.empty();
    records_.push_back(record);
  }
  if (was_empty && wake_) wake_();
}

std::vector<TraceRecord> TraceQueue::Take() {
  const MutexLock lock(mutex_);
  std::vector<TraceRecord> taken(std::make_move_iterator(records_.begin()),
                                 std::make_move_iterator(records_.end()));
  records_.clear();
  if (dropped_ > 0) {
    // The queue was full until now, so the dropped records were newer than all records in it.
    TraceRecord note;
    note.at = taken.back().at;
    note.text = fmt::format("{} records were dropped, because the reader of the trace is too slow",
                            std::exchange(dropped_, 0));
    taken.push_back(std::move(note));
  }
  return taken;
}

namespace {

constexpr std::string_view kDevice = "# device ";
constexpr std::string_view kProtocol = "protocol ";
constexpr std::string_view kProfile = "profile ";
constexpr std::string_view kSet = "set ";
constexpr std::string_view kBetween = ", ";

bool FitsHead(const std::string& text) {
  return text.find(kBetween) == std::string::npos &&
         std::ranges::none_of(text, [](char c) { return static_cast<unsigned char>(c) < 0x20; });
}

std::string DeviceComment(const config::Device& device) {
  std::string text = std::string(kDevice) + device.name;
  const auto add = [&text](std::string_view what, const std::string& value) {
    if (!value.empty() && FitsHead(value)) text.append(kBetween).append(what).append(value);
  };
  add(kProtocol, device.protocol);
  add(kProfile, device.profile);
  for (const auto& [name, written] : device.options.written()) add(kSet, name + "=" + written);
  return text;
}

std::string_view TakePart(std::string_view& text) {
  const std::size_t end = text.find(kBetween);
  const std::string_view part = text.substr(0, end);
  text = end == std::string_view::npos ? "" : text.substr(end + kBetween.size());
  return part;
}

}  // namespace

std::vector<std::string> TraceHead(const config::Line& line) {
  std::string first = "# line " + line.name + ", port " + line.port;
  if (!line.tcp) first += " " + line.serial.ToString();
  std::vector<std::string> head = {first + ", protocol " + line.protocol};
  for (const config::Device& device : line.devices) head.push_back(DeviceComment(device));
  return head;
}

std::optional<TracedDevice> ReadTracedDevice(std::string_view line) {
  if (!line.starts_with(kDevice)) return std::nullopt;
  std::string_view rest = line.substr(kDevice.size());
  TracedDevice device{.name = std::string(TakePart(rest))};
  while (!rest.empty()) {
    const std::string_view part = TakePart(rest);
    if (part.starts_with(kProtocol)) device.protocol = part.substr(kProtocol.size());
    if (part.starts_with(kProfile)) device.profile = part.substr(kProfile.size());
    if (part.starts_with(kSet)) device.set.emplace_back(part.substr(kSet.size()));
  }
  if (device.name.empty() || device.protocol.empty()) return std::nullopt;
  return device;
}

}  // namespace baudgate::records
