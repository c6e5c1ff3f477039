// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/recognise.h"

#include <algorithm>
#include <string>

#include "protocols/spabus/codec.h"
#include "protocols/spabus/reply.h"

namespace baudgate::protocols::spabus {
namespace {

std::string Slave(unsigned slave) { return "slave " + std::to_string(slave); }

}  // namespace

std::optional<Recognised> Recognise(View request, View heard, const config::Options&) {
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
    if (!reply || !asked || reply->slave == *asked || MatchingReadings(message, false) == 0)
      continue;
    return Recognised{Recognised::What::other_device,
                      Slave(reply->slave) + " answers where " + Slave(*asked) + " was asked",
                      "check the address that is set at the device"};
  }
  return std::nullopt;
}

}  // namespace baudgate::protocols::spabus
