// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/recognise.h"

#include <algorithm>
#include <cctype>
#include <string>

#include "gateway/base/text.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/reply.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {
namespace {

/// "<1D:0:".
constexpr std::size_t kShortest = 6;

std::string Slave(unsigned slave) { return "slave " + std::to_string(slave); }

/// A message of the slave that was asked, which has its own check value and is no reply.
std::optional<Recognised> OtherForm(View message) {
  if (ParseReply(message) || MatchingReadings(message, false) == 0) return std::nullopt;
  return Recognised{Recognised::What::other_reply,
                    "its replies have a right check value and another form ('" +
                        std::string(Trim(AsText(message))) + "')",
                    "the device or its firmware does not keep to the SPA bus"};
}

/// A reply of the slave that was asked, which would be right with another option.
std::optional<Recognised> OtherOption(View message, const Settings& settings) {
  const auto other = [](const char* cause, const char* remedy) {
    return Recognised{Recognised::What::other_setting, cause, remedy};
  };
  const auto reply = ParseReply(message);
  if (reply && reply->wildcard && !settings.accept_wildcard) {
    return other("its replies carry XX in place of a checksum",
                 "set accept_xx: true in the configuration, or checksums in it");
  }
  const bool counts = settings.line_feed_in_checksum;
  if (reply && MatchingReadings(message, !counts) != 0 && MatchingReadings(message, counts) == 0) {
    return counts ? other("its checksums do not count the line feed in front",
                          "set lf_in_checksum: false in the configuration")
                  : other("its checksums count the line feed in front",
                          "set lf_in_checksum: true in the configuration");
  }
  if (message.size() > kShortest && message[message.size() - 2] == ':') {
    return other("its replies carry no checksum",
                 "the device or a converter in between does not keep to the SPA bus");
  }
  return std::nullopt;
}

/// "<D:0:33" where "<1D:0:33" belongs.
bool IsNameless(View message, const std::string& name) {
  if (message.size() < 2 || !std::isalpha(message[1])) return false;
  Bytes named(message.begin(), message.begin() + 1);
  Append(named, ToBytes(name));
  Append(named, message.subspan(1));
  return MatchingReadings(named, false) != 0 || MatchingReadings(message, false) != 0;
}

}  // namespace

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings) {
  const auto asked = ParseRequest(request).slave;
  while (!heard.empty()) {
    const auto begin = std::ranges::find_if(heard, [](auto c) { return c == '<' || c == '>'; });
    const auto end = std::find(begin, heard.end(), kCr);
    if (end == heard.end()) return std::nullopt;
    const View message(begin, end + 1);
    heard = View(end + 1, heard.end());
    if (message[0] == '>') {
      const ReceivedRequest other = ParseRequest(message);
      if (!other.intact || !other.slave || !other.command || std::ranges::equal(message, request))
        continue;
      return Recognised{Recognised::What::other_master,
                        "another master speaks on the line: it has asked " + Slave(*other.slave),
                        "an SPA bus has one master: take the other one away"};
    }
    const auto reply = ParseReply(message);
    const std::string name = asked ? std::to_string(*asked) : std::string();
    if (asked && AsText(message).substr(1).starts_with(name)) {
      if (auto other = OtherOption(message, settings)) return other;
      if (auto other = OtherForm(message)) return other;
    }
    if (asked && IsNameless(message, name)) {
      return Recognised{Recognised::What::other_setting, "its replies carry no slave number",
                        "the device or a converter in between does not keep to the SPA bus"};
    }
    if (!reply || !asked || reply->slave == *asked || MatchingReadings(message, false) == 0)
      continue;
    return Recognised{Recognised::What::other_device,
                      Slave(reply->slave) + " answers where " + Slave(*asked) + " was asked",
                      "check the address that is set at the device"};
  }
  return std::nullopt;
}

}  // namespace baudgate::protocols::spabus
