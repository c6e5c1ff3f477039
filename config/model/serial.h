// `SerialSettings` contains the settings of a serial port.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "config/model/fields.h"
#include "gateway/base/time.h"

namespace baudgate::config {

enum class Parity : std::uint8_t { none, even, odd, mark, space };

char LetterOf(Parity parity);
/// Accepts upper and lower case. Returns nothing if no parity has this letter.
std::optional<Parity> ParityOf(char letter);

struct Rs485 {
  bool enabled = false;          ///< true: the key `rs485` is present
  Duration delay_before_send{};  ///< whole milliseconds, because drivers support nothing else
  Duration delay_after_send{};
  bool rts_active_high = true;
  bool receive_while_sending = false;
};

template <typename Visit>
void VisitFields(const Rs485*, Visit visit) {
  visit(Field<&Rs485::enabled>{.help = "the driver switches the direction", .fallback = "true"});
  visit(Field<&Rs485::delay_before_send>{"delay_before_send", "time from RTS to the first bit", 0ms,
                                         1s});
  visit(Field<&Rs485::delay_after_send>{"delay_after_send", "time from the last bit to RTS", 0ms,
                                        1s});
  visit(Field<&Rs485::rts_active_high>{.help = "RTS is high while the gateway sends"});
  visit(Field<&Rs485::receive_while_sending>{.help = "the port receives what it sends"});
}

inline constexpr int kSlowestBaud = 300;
inline constexpr int kFastestBaud = 921'600;

struct SerialSettings {
  int baud = 9600;    ///< bit/s; non-standard rates are allowed
  int data_bits = 8;  ///< 7 or 8; clients of serial_server can also set 5 and 6
  Parity parity = Parity::none;
  int stop_bits = 1;  ///< 1 or 2
  /// The port supports 8N1 only, so the gateway makes and checks parity.
  bool software_parity = false;
  bool rtscts = false;
  bool xonxoff = false;  ///< flow control by the bytes 0x11 and 0x13, which cannot be data then
  bool low_latency = true;
  Rs485 rs485{};

  /// The bit rate of a protocol that runs only over networks. It is high enough to delay nothing.
  static constexpr int kNoWire = 4'000'000;
  /// False for a protocol that runs only over networks, so that there are no serial settings to
  /// check.
  bool on_wire() const { return baud != kNoWire; }
  int BitsPerCharacter() const {
    return 1 + data_bits + (parity == Parity::none ? 0 : 1) + stop_bits;
  }
  Duration CharacterTime() const { return Duration(1'000'000'000LL * BitsPerCharacter() / baud); }
  /// Returns "9600 7E1".
  std::string ToString() const;
};

template <typename Visit>
void VisitFields(const SerialSettings*, Visit visit) {
  constexpr std::string_view kOwn = "the protocol's";
  visit(Field<&SerialSettings::baud>{"baud", "bit/s", kSlowestBaud, kFastestBaud, kOwn});
  visit(Field<&SerialSettings::data_bits>{"data", "bits of a character", 7, 8, kOwn});
  visit(Field<&SerialSettings::stop_bits>{"stop", "stop bits", 1, 2, kOwn});
  visit(Field<&SerialSettings::software_parity>{
      .help = "for ports that support 8N1 only: the gateway makes and checks the parity bit"});
  visit(Field<&SerialSettings::parity>{.help = "also N, E, O, M, S; software as software_parity",
                                       .fallback = kOwn});
  visit(Field<&SerialSettings::rtscts>{.help = "flow control by RTS and CTS"});
  visit(Field<&SerialSettings::xonxoff>{
      .help = "flow control by the bytes 0x11 and 0x13: not with binary protocols"});
  visit(Field<&SerialSettings::low_latency>{.help = "asks the driver to deliver bytes at once"});
  visit(Field<&SerialSettings::rs485>{.help = "a map, below"});
}

}  // namespace baudgate::config
