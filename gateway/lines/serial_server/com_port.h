// What a client asks of the port by RFC 2217 (COM-PORT-OPTION), and what it is told: settings,
// control lines, modem and line states, purging, suspension. The port is a transport; sockets
// are server.cpp's, times session.cpp's.
//
//   01 00 00 25 80     SET-BAUDRATE 9600      answered by 65 00 00 25 80: what the port does now
//   01 00 00 00 00     the same as a question
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "config/model/serial.h"
#include "gateway/base/bytes.h"
#include "transports/transport.h"

namespace baudgate::serial_server {

class ComPort {
 public:
  /// `port` is set to `serial`, its control lines are on; it outlives this.
  ComPort(Transport& port, const config::SerialSettings& serial, std::string signature);

  /// One command, without the number of the option. The answer, in its telnet form; empty: none is
  /// due. What the driver refuses stays as it was, and the answer says so.
  Bytes On(View command);
  /// Begins a break, or ends it where no SET-CONTROL command has asked for one. False: the driver
  /// makes none.
  bool Break(bool on);
  /// What has changed at the port since the last call, as far as the client wants to hear it.
  Bytes Poll();
  /// The client has asked for silence: nothing from the port is sent to it.
  bool suspended() const { return suspended_; }

 private:
  Bytes SetBaud(View value);
  Bytes SetOne(std::uint8_t command, std::uint8_t value);
  Bytes SetControl(std::uint8_t value);
  std::uint8_t Flow(std::uint8_t ask, std::uint8_t value);
  std::uint8_t Switch(PortSwitch which, bool& state, std::uint8_t ask, std::uint8_t value);
  void Try(const config::SerialSettings& wanted);
  std::uint8_t ParityCode() const;
  std::uint8_t StopCode() const;
  std::uint8_t ModemState();
  std::uint8_t LineState();
  Bytes Purge(std::uint8_t what);
  Bytes NotifyModem(std::uint8_t state) const;

  Transport& port_;
  config::SerialSettings serial_;
  const bool software_;  // the port knows 8N1 only
  const std::string signature_;
  bool dtr_ = true;
  bool rts_ = true;
  bool break_ = false;
  bool suspended_ = false;
  bool greeted_ = false;  // it knows the modem state
  std::uint8_t modem_mask_ = 0xFF;
  std::uint8_t line_mask_ = 0;
  std::uint8_t modem_ = 0;  // levels, as told last
  PortCounters counters_;
};

}  // namespace baudgate::serial_server
