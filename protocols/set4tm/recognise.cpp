// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/recognise.h"

#include <algorithm>
#include <string>
#include <string_view>

#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/settings.h"
#include "protocols/set4tm/status.h"

namespace baudgate::protocols::set4tm {
namespace {

/// A sum of one byte fits by chance in one of 256: address, status, sum.
constexpr std::size_t kShortestKs = 3;
/// Code and parameter.
constexpr std::size_t kShortestRead = 2;

/// The GSM communicator answers in its own name for a meter that is silent.
constexpr std::uint8_t kCommunicator = 0xFD;

bool IsOfCommunicator(const Parts& reply) {
  return reply.address[0] == kCommunicator && reply.body.size() == 1 &&
         CodeOf(reply.body[0]) == kMeterSilent;
}

std::string Meter(View address) { return "meter " + FormatAddress(address); }

std::string RemedyFor(const Parts& reply) {
  if (reply.address[0] != kExtendedPrefix) return "check the address that is set in the meter";
  const std::string number = FormatAddress(reply.address).substr(std::string_view("sn:").size());
  return "set serial_number: " + number + " in the configuration, if that is the right meter";
}

/// A whole request that is not ours. Shorter ones than a read look like replies.
std::optional<Recognised> FindRequest(View request, View heard, Checksum checksum) {
  const std::size_t tail = SizeOf(checksum);
  for (std::size_t at = 0; at < heard.size(); ++at) {
    const View held = heard.subspan(at);
    const std::size_t head = AddressLength(held[0]);
    if (held.size() <= head + tail) break;
    const auto length = LengthOfRequest(held.subspan(head));
    if (!length || !length->known || length->max < kShortestRead) continue;
    const std::size_t size = head + length->max + tail;
    if (held.size() < size || !EndsInChecksum(held.first(size), checksum)) continue;
    if (std::ranges::equal(held.first(size), request)) continue;
    return Recognised{Recognised::What::other_master,
                      "another master speaks on the line: it has asked " + Meter(held.first(head)),
                      "a serial line has one master: take the other one away"};
  }
  return std::nullopt;
}

}  // namespace

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings) {
  const Checksum checksum = settings.checksum;
  auto asked = SplitFrame(request, checksum);
  if (!asked) asked = SplitFrame(request, Other(checksum));
  if (!asked) return std::nullopt;
  const bool any = asked->address.size() == 1 && asked->address[0] == kCommonAddress;
  if (auto other = FindRequest(request, heard, checksum)) return other;
  if (const auto reply = SplitFrame(heard, checksum)) {
    if (any || std::ranges::equal(reply->address, asked->address)) return std::nullopt;
    if (IsOfCommunicator(*reply)) {
      return Recognised{Recognised::What::other_reply,
                        "the GSM communicator (253) says that the meter does not answer",
                        "check power, wire and address of the meter behind it"};
    }
    return Recognised{
        Recognised::What::other_device,
        Meter(reply->address) + " answers where " + Meter(asked->address) + " was asked",
        RemedyFor(*reply)};
  }
  const bool ks = checksum == Checksum::crc;
  if (ks && heard.size() > 3) {
    Bytes swapped(heard.begin(), heard.end());
    std::swap(swapped[swapped.size() - 1], swapped[swapped.size() - 2]);
    const auto reply = SplitFrame(swapped, checksum);
    if (reply && std::ranges::equal(reply->address, asked->address)) {
      return Recognised{Recognised::What::other_setting, "its CRC comes high byte first",
                        "a converter in between, or the meter, does not keep to the protocol"};
    }
  }
  const auto other = SplitFrame(heard, Other(checksum));
  if (!other || (ks && heard.size() < kShortestKs)) return std::nullopt;
  if (!std::ranges::equal(other->address, asked->address)) return std::nullopt;
  return Recognised{Recognised::What::other_setting,
                    ks ? "its replies end in a sum of one byte, not in a CRC"
                       : "its replies end in a CRC, not in a sum of one byte",
                    std::string("set checksum: ") + (ks ? "ks" : "crc") + " in the configuration"};
}

}  // namespace baudgate::protocols::set4tm
