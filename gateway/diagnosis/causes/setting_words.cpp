// The sentences about serial settings: bit rate, parity, data bits and the protocol of a port.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "gateway/diagnosis/causes/hypotheses.h"

namespace baudgate::control {
namespace {

using enum Symptom;

/// A reply has at least so many characters. If each comes as 00 or FF, the parity is wrong.
constexpr std::size_t kWholeReply = 6;

}  // namespace

std::string SayEighthBit(const Evidence& evidence) {
  const config::SerialSettings serial = SerialOf(evidence.first());
  const bool mark = !evidence.Last(eighth_bit).cause.empty();
  const std::string cause =
      mark ? "the eighth bit of its characters is always 1: 7 data bits with mark parity, or two "
             "stop bits; "
           : "right once the eighth bit is taken away: it sends 7 data bits with parity; ";
  const std::string set = mark ? "7M1 or 7N2" : "7E1 or 7O1";
  if (IsBehindServer(evidence)) return cause + "set " + set + " at the port of the serial server";
  if (serial.data_bits > 7)
    return cause + "set serial: to " + set + " (now " + serial.ToString() + ")";
  return cause + "the adapter does not do " + serial.ToString() + ": use another, or " +
         (mark ? "7N2" : "7O1");
}

std::string SaySevenBits(const Evidence& evidence) {
  const std::string cause = "no character of its replies has its eighth bit: ";
  if (IsBehindServer(evidence)) {
    return cause + "the port of the serial server has 7 data bits; set 8 there";
  }
  return cause + "the port or a converter in between has 7 data bits; set 8 (now " +
         SerialOf(evidence.first()).ToString() + ")";
}

std::string SayOtherParity(const Evidence& evidence) {
  const bool network = evidence.line->is_network();
  return std::string("only characters of one parity come") +
         (network ? "" : ", and FF in place of the others") + ": its parity is another one; set " +
         (network ? "serial server and device" : "both") + " alike (" +
         SerialOf(evidence.first()).ToString() + ")";
}

std::string SaySettings(const Evidence& evidence) {
  const DeviceRecord& record = evidence.first();
  const std::string serial = SerialOf(record).ToString();
  if (evidence.changed) {
    const char* const what = record.status.unasked ? "message" : "frame";
    return std::string("bytes come, and not one good ") + what +
           " any more: its bit rate or parity was changed (" + serial +
           " here): set both alike; or A and B are swapped";
  }
  if (record.status.unasked) {
    return "bytes come, and no message: its bit rate or parity differs (" + serial +
           " here): set both alike; or its messages are not those of the profile";
  }
  if (!evidence.healthy.empty()) {
    return "its replies cannot be read: a setting differs: " + Settings(record) +
           "; or two devices have its address (" + record.device->address + ")";
  }
  return "bytes come, and not one good frame: a setting differs: " + Settings(record) +
         (IsBehindServer(evidence) ? "" : ": 'baudgate scan' finds it; or A and B are swapped");
}

std::string SayNoTcp(const Evidence& evidence) {
  const std::string other(evidence.traits().counterpart);
  return "what comes is not " + std::string(evidence.traits().service) + ": check the port (" +
         evidence.line->port + ")" +
         (other.empty() ? "" : "; a plain serial server needs protocol: " + other);
}

std::string SayZeros(const Evidence& evidence) {
  const config::SerialSettings serial = SerialOf(evidence.first());
  if (evidence.Last(zeros).bytes >= kWholeReply && serial.parity != config::Parity::none) {
    return fmt::format(
        "nothing but 00 or FF comes ({} bytes): each character has a wrong parity; set it alike "
        "({}), or look for A and B swapped",
        evidence.Last(zeros).bytes, serial.ToString());
  }
  if (serial.parity != config::Parity::none) {
    return "nothing but 00 or FF comes: check the parity and the bit rate (" + serial.ToString() +
           "), then A and B, the bias resistors and who drives the line";
  }
  return "nothing but 00 or FF comes: check A and B, the bias resistors and who drives the line, "
         "then bit rate and parity (" +
         serial.ToString() + ")";
}

std::string CheckOf(const DeviceRecord& record) {
  const auto checksum = record.device->options.all().find("checksum");
  if (checksum == record.device->options.all().end()) return {};
  if (const bool* flag = std::get_if<bool>(&checksum->second)) {
    return std::string(", checksum ") + (*flag ? "on here" : "off here");
  }
  const auto* word = std::get_if<std::string>(&checksum->second);
  return word == nullptr ? std::string() : ", checksum " + *word + " here";
}

std::string Settings(const DeviceRecord& record) {
  const std::string check = CheckOf(record);
  const bool server = record.line->is_network();
  return std::string("bit rate, parity") + (check.empty() ? "" : ", checksum") + " and protocol" +
         (server ? " at device and serial server" : "") + " (" + SerialOf(record).ToString() +
         check + ", " + record.device->protocol + ")";
}

}  // namespace baudgate::control
