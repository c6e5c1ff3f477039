// Builds described devices for tests.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "config/loader.h"
#include "gateway/base/text.h"
#include "protocols/assembler.h"
#include "protocols/telegram/protocol.h"
#include "tests/support/talk.h"

namespace baudgate::protocols::telegram {

inline config::LoadedProfile LoadText(const std::string& text) {
  config::Catalog catalog;
  catalog.protocols["telegram"] = &TelegramProtocol();
  return config::LoadProfileText(text, "p.yaml", "p", TelegramProtocol(), catalog);
}

inline config::Device Described(const std::string& text, const Settable& options = {},
                                const std::string& address = "1") {
  const config::LoadedProfile loaded = LoadText(text);
  for (const auto& problem : loaded.problems) ADD_FAILURE() << config::ToString(problem);
  config::Device device =
      config::DeviceFromProfile(loaded.profile, TelegramProtocol(), "device", address);
  for (const auto& [name, value] : options) device.options.Set(name, value);
  return device;
}

inline config::Device ShippedDevice(const Protocol& protocol, const std::string& profile) {
  config::Catalog catalog;
  catalog.protocols[std::string(protocol.name)] = &protocol;
  catalog.profile_dirs = {"config/profiles"};
  const auto loaded = config::LoadProfile(profile, protocol, catalog);
  for (const auto& problem : loaded.problems) ADD_FAILURE() << config::ToString(problem);
  return config::DeviceFromProfile(loaded.profile, protocol, "device", "1");
}

inline Answer AnswerTo(const Protocol& protocol, const config::Device& device, View request,
                       View stream) {
  Assembler assembler;
  assembler.Begin(protocol.reply_rule,
                  protocol.expect(request, ParseOptions(protocol, device.options)));
  assembler.Feed(stream);
  auto frame = assembler.Next(false);
  if (!frame) frame = assembler.Next(true);
  if (!frame) return {assembler.blame()};
  const auto bus = MakeBus(protocol);
  return MakeConversation(protocol, device, bus.get())->Interpret(request, *frame);
}

/// Returns the readings as text. Example: "weight 100 good; unit g good".
inline std::string Said(const config::Device& device, const Answer& answer) {
  std::string text;
  for (const Reading& reading : answer.readings) {
    if (reading.point >= device.points.size()) continue;
    const std::string value = ToText(reading.value);
    text += (text.empty() ? "" : "; ") + device.points[reading.point].name + " " + value +
            (value.empty() ? "" : " ") + Name(reading.quality);
  }
  return answer.outcome == Outcome::ok ? text : std::string(Name(answer.outcome));
}

}  // namespace baudgate::protocols::telegram
