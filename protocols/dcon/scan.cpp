// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/scan.h"

#include "gateway/base/text.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/identification.h"

namespace baudgate::protocols::dcon {
namespace {

constexpr config::SerialSettings kSerials[] = {{.baud = 9600},
                                               {.baud = 115200},
                                               {.baud = 19200},
                                               {.baud = 38400},
                                               {.baud = 57600},
                                               {.baud = 4800},
                                               {.baud = 2400},
                                               {.baud = 1200},
                                               {.baud = 9600, .parity = config::Parity::even},
                                               {.baud = 9600, .parity = config::Parity::odd},
                                               {.baud = 9600, .stop_bits = 2}};

constexpr ScanMode kModes[] = {{}, {"checksum", "true"}};
constexpr std::size_t kWithChecksum = 1;

constexpr const char* kScanQuestions[] = {kAskName, kAskType};
/// Address, type, bit rate and format in hex.
constexpr std::size_t kConfiguration = 8;

Bytes AskModule(unsigned address, std::size_t mode, std::size_t question) {
  return BuildRequest(kScanQuestions[question], static_cast<std::uint8_t>(address),
                      mode == kWithChecksum);
}

/// A module that was started with INIT* grounded answers at 00, and `$002` with its own address.
Sighting JudgeModule(View request, View frame, std::size_t mode) {
  const bool checksum = mode == kWithChecksum;
  const auto asked = ParseRequest(request, checksum);
  const auto reply = ParseReply(frame, checksum ? kChecksum : kNoChecksum);
  Sighting sighting;
  if (!asked || !reply || reply->lead == '>' || reply->body.size() < 2) return sighting;
  const bool init = asked->address == 0 && asked->text == kAskType;
  if (reply->body.substr(0, 2) != HexByte(asked->address) && !init) return sighting;
  if (reply->lead == '?') {
    if (reply->body.size() == 2) sighting.what = Sighting::What::device;
    return sighting;
  }
  if (asked->text == kAskType) {
    if (reply->body.size() != kConfiguration || !IsHexText(reply->body)) return sighting;
    sighting.what = Sighting::What::device;
    return sighting;
  }
  sighting.what = Sighting::What::device;
  sighting.identity = Trim(std::string_view(reply->body).substr(2));
  if (sighting.identity.empty()) return sighting;
  sighting.names = {sighting.identity};
  sighting.point = "{ name: module_name, read: \"$M\", type: string(16), group: slow }";
  return sighting;
}

}  // namespace

const ScanRule kScan = {.serials = kSerials,
                        .first_address = 0,
                        .last_address = 255,
                        .modes = kModes,
                        .quick_modes = 2,
                        .questions = 2,
                        .finds = 0b11,
                        .quick_finds = 0b01,
                        .usual = 60ms,
                        .ask = AskModule,
                        .judge = JudgeModule};

}  // namespace baudgate::protocols::dcon
