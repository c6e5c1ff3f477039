// Toy devices with a poll period, or with a word in place of values.
#pragma once

#include <string>
#include <string_view>

#include "tests/support/virtual_line.h"

namespace baudgate::bus {

inline config::Device Polled(config::Device device, Duration poll) {
  device.poll = poll;
  return device;
}

inline void Say(VirtualLine::WireTwin& twin, const std::string& word) {
  twin.manner.instead = [word](View request) -> std::optional<Bytes> {
    const std::string_view text = AsText(request);
    if (text[0] != '?') return std::nullopt;
    return ToyReply(std::string(text.substr(1, text.size() - 2)) + "~" + word);
  };
}

}  // namespace baudgate::bus
