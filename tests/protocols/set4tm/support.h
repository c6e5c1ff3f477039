// Builds SET-4TM meters, their replies, and PDUs in hex for tests.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/text.h"
#include "protocols/assembler.h"
#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/protocol.h"
#include "protocols/set4tm/rules.h"
#include "protocols/set4tm/twin/twin.h"
#include "tests/support/talk.h"

namespace baudgate::protocols::set4tm {

inline constexpr std::uint32_t kMeter = 9020001;

inline Bytes Hex(std::string_view text) { return *ParseHex(text); }

inline config::Options DefaultOptions() { return OptionsOf(Set4tmProtocol()); }
inline Settings DefaultSettings() { return ReadSettings(DefaultOptions()); }

inline config::Point MakePoint(const std::string& read, config::Group group = config::Group::fast,
                               config::Type type = config::Type::float64) {
  return ReadPoint("p", read, type, group);
}

inline config::Device MakeDevice(const std::string& address, std::vector<config::Point> points,
                                 const Settable& options = {}) {
  config::Device device = DeviceOf(Set4tmProtocol(), address, std::move(points), options);
  if (options.empty()) device.options.Set("snapshot", std::string("false"));
  return device;
}

/// Returns and clears the requested PDUs in hex. A password is shown as "01".
inline std::vector<std::string> TakeAsked(Talk& talk) {
  std::vector<std::string> pdus;
  for (const Bytes& frame : std::exchange(talk.asked, {})) {
    const std::size_t head = frame[0] == 0xFC ? 5 : 1;
    const bool open = frame[head] == 0x01;
    pdus.push_back(open ? "01" : ToHex(View(frame).subspan(head, frame.size() - head - 2)));
  }
  return pdus;
}

inline constexpr const char* kOneFloat = "08 1B 00 11 float_le@0";

/// Answers each request with the next text of `bodies`, from the address that the request names.
inline Wire Script(std::vector<std::string> bodies) {
  auto rest = std::make_shared<std::vector<std::string>>(std::move(bodies));
  return [rest](View request) {
    if (rest->empty()) return Bytes();
    const Bytes body = Hex(rest->front());
    rest->erase(rest->begin());
    const auto parts = SplitFrame(request);
    return body.empty() ? Bytes() : MakeFrame(parts->address, body);
  };
}

inline config::Device OneFloat() { return MakeDevice("200", {MakePoint(kOneFloat)}); }

inline Talk OpenTalk(const config::Device& device) {
  Talk talk(Set4tmProtocol(), device);
  talk.Run(Probe(), Script({"00"}));
  talk.asked.clear();
  return talk;
}

}  // namespace baudgate::protocols::set4tm
