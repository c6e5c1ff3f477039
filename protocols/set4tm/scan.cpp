// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/scan.h"

#include <algorithm>

#include "protocols/set4tm/codec.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr config::SerialSettings Odd(int baud) {
  return {.baud = baud, .parity = config::Parity::odd};
}

constexpr config::SerialSettings kSerials[] = {
    Odd(9600),  {.baud = 9600},  Odd(19200), {.baud = 19200}, Odd(4800),
    Odd(38400), {.baud = 38400}, Odd(2400),  Odd(1200),       {.baud = 4800}};

constexpr ScanMode kModes[] = {{}, {"checksum", "ks"}};

constexpr std::size_t kLink = 0;
/// Serial number and date of manufacture.
constexpr std::size_t kSerialReply = 7;

Checksum ChecksumOf(std::size_t mode) { return mode == 1 ? Checksum::ks : Checksum::crc; }

Bytes AskMeter(unsigned address, std::size_t mode, std::size_t question) {
  const Bytes own = {static_cast<std::uint8_t>(address)};
  const Bytes pdu = question == kLink ? Bytes{kLinkTest} : Bytes{kRead, kSerialNumber};
  return MakeFrame(own, pdu, ChecksumOf(mode));
}

Sighting JudgeMeter(View request, View frame, std::size_t mode) {
  const auto asked = SplitFrame(request, ChecksumOf(mode));
  const auto reply = SplitFrame(frame, ChecksumOf(mode));
  Sighting sighting;
  if (!asked || !reply) return sighting;
  // With a flag of its own a meter answers by its extended address, whoever was asked.
  const bool extended = reply->address.size() > 1;
  if (!extended && !std::ranges::equal(reply->address, asked->address)) return sighting;
  if (asked->body[0] == kLinkTest) {
    if (reply->body.size() == 1) sighting.what = Sighting::What::maybe;
    return sighting;
  }
  if (reply->body.size() != 1 && reply->body.size() != kSerialReply) return sighting;
  sighting.what = Sighting::What::device;
  if (reply->body.size() != kSerialReply) return sighting;
  sighting.identity = "serial " + std::to_string(*ByteReader(reply->body).U32Be(0));
  return sighting;
}

}  // namespace

const ScanRule kScan = {.serials = kSerials,
                        .first_address = 1,
                        .last_address = 239,
                        .modes = kModes,
                        .questions = 2,
                        .usual = 120ms,
                        .assumed_profile = "set-4tm.03m",
                        .ask = AskMeter,
                        .judge = JudgeMeter};

}  // namespace baudgate::protocols::set4tm
