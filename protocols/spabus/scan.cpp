// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/scan.h"

#include "gateway/base/text.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/reply.h"

namespace baudgate::protocols::spabus {
namespace {

constexpr config::SerialSettings Even(int baud) {
  return {.baud = baud, .data_bits = 7, .parity = config::Parity::even};
}

constexpr config::SerialSettings kSerials[] = {
    Even(9600),
    Even(4800),
    Even(19200),
    Even(2400),
    Even(38400),
    Even(1200),
    {.baud = 9600, .data_bits = 7, .parity = config::Parity::odd},
    {.baud = 9600, .data_bits = 8},
    {.baud = 9600, .data_bits = 8, .parity = config::Parity::even}};

constexpr ScanMode kModes[] = {{}, {"send_xx", "true"}};

Bytes AskDesignation(unsigned address, std::size_t mode, std::size_t) {
  return Encode(ReadOf(address, {.channel = 0, .category = 'F', .number = {}}, 0), mode == 1);
}

Sighting JudgeDesignation(View request, View frame, std::size_t) {
  Sighting sighting;
  const auto reply = ParseReply(frame);
  if (!reply || reply->slave != ParseRequest(request).slave || reply->type == 'A') return sighting;
  sighting.what = Sighting::What::device;
  if (reply->type != 'D') return sighting;
  sighting.identity = Trim(reply->data);
  sighting.names = {sighting.identity};
  sighting.point = "{ name: designation, read: F, type: string(40), group: slow }";
  return sighting;
}

}  // namespace

// Addresses up to 899: 900 is that of broadcasts.
const ScanRule kScan = {.serials = kSerials,
                        .first_address = 1,
                        .last_address = 899,
                        .modes = kModes,
                        .usual = 80ms,
                        .ask = AskDesignation,
                        .judge = JudgeDesignation};

}  // namespace baudgate::protocols::spabus
