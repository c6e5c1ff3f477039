// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/trace/trace_head.h"

#include <algorithm>

namespace baudgate {
namespace {

constexpr std::string_view kDevice = "# device ";
constexpr std::string_view kProtocol = "protocol ";
constexpr std::string_view kProfile = "profile ";
constexpr std::string_view kSet = "set ";
constexpr std::string_view kBetween = ", ";

/// What would not be read back as it is has no place in the head.
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

}  // namespace baudgate
