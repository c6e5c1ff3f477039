// How a serial port is set.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "config/model/fields.h"
#include "gateway/base/time.h"

namespace baudgate::config {

enum class Parity : std::uint8_t { none, even, odd, mark, space };

/// 'N', 'E', 'O', 'M' or 'S'.
char LetterOf(Parity parity);
/// In either case; empty: no parity has this letter.
std::optional<Parity> ParityOf(char letter);

struct Rs485 {
  bool enabled = false;
  Duration delay_before_send{};  ///< RTS to first bit; the driver knows milliseconds only
  Duration delay_after_send{};
  bool rts_active_high = true;
  bool receive_while_sending = false;
};

template <typename Visit>
void VisitFields(const Rs485*, Visit visit) {
  visit(Field<&Rs485::enabled>());
  visit(Field<&Rs485::delay_before_send>());
  visit(Field<&Rs485::delay_after_send>());
  visit(Field<&Rs485::rts_active_high>());
  visit(Field<&Rs485::receive_while_sending>());
}

struct SerialSettings {
  int baud = 9600;    ///< bit/s, 300…921600, non-standard rates included
  int data_bits = 8;  ///< 7 or 8; clients of a port (serial_server) may set 5 and 6 as well
  Parity parity = Parity::none;
  int stop_bits = 1;             ///< 1 or 2
  bool software_parity = false;  ///< the port does 8N1 only: parity is made and checked here
  bool rtscts = false;           ///< flow control by RTS and CTS
  bool xonxoff = false;     ///< flow control by the bytes 0x11 and 0x13, which are no data then
  bool low_latency = true;  ///< ask the driver to deliver bytes at once
  Rs485 rs485{};

  /// The bit rate of a protocol that only networks carry: a pace that slows nothing down.
  static constexpr int kNoWire = 4'000'000;
  /// False: there are no serial settings, and nothing about a wire can be wrong.
  bool on_wire() const { return baud != kNoWire; }
  /// Start, data, parity and stop bits of one character.
  int BitsPerCharacter() const {
    return 1 + data_bits + (parity == Parity::none ? 0 : 1) + stop_bits;
  }
  Duration CharacterTime() const { return Duration(1'000'000'000LL * BitsPerCharacter() / baud); }
  /// "9600 7E1".
  std::string ToString() const;
};

template <typename Visit>
void VisitFields(const SerialSettings*, Visit visit) {
  visit(Field<&SerialSettings::baud>());
  visit(Field<&SerialSettings::data_bits>());
  visit(Field<&SerialSettings::parity>());
  visit(Field<&SerialSettings::stop_bits>());
  visit(Field<&SerialSettings::software_parity>());
  visit(Field<&SerialSettings::rtscts>());
  visit(Field<&SerialSettings::xonxoff>());
  visit(Field<&SerialSettings::low_latency>());
  visit(Field<&SerialSettings::rs485>());
}

}  // namespace baudgate::config
