// SPDX-License-Identifier: Apache-2.0
#include "config/checks/serial_checks.h"

#include <string_view>
#include <utility>

namespace baudgate::config {

void CheckTiming(const Timing& timing, const Mark& mark, Problems& problems) {
  if (timing.ceiling && timing.reply && *timing.ceiling < *timing.reply) {
    problems.Error(mark, "timing: ceiling " + FormatDuration(*timing.ceiling) +
                             " is shorter than reply " + FormatDuration(*timing.reply) +
                             "; it covers the whole exchange");
  }
}

void CheckSoftwareParity(const SerialSettings& serial, const Mark& mark, Problems& problems) {
  if (!serial.software_parity) return;
  const bool even_or_odd = serial.parity == Parity::even || serial.parity == Parity::odd;
  if (serial.data_bits == 7 && even_or_odd && serial.stop_bits == 1) return;
  problems.Error(mark, "parity: software parity is made inside 8N1 and needs 7E1 or 7O1, not " +
                           serial.ToString().substr(serial.ToString().find(' ') + 1));
}

void CheckFlowControl(const SerialSettings& serial, const Keys& keys, Problems& problems) {
  if (serial.rtscts && serial.xonxoff) {
    problems.Error(keys.MarkOf("xonxoff"),
                   "xonxoff: the port has one flow control; remove xonxoff or rtscts");
  }
  if (serial.rtscts && serial.rs485.enabled) {
    problems.Error(keys.MarkOf("rtscts"),
                   "rtscts: with rs485 the driver switches the direction by RTS; remove one");
  }
}

void CheckRs485(const Rs485& rs485, const Keys& keys, Problems& problems) {
  for (const auto& [key, delay] : {std::pair("delay_before_send", rs485.delay_before_send),
                                   std::pair("delay_after_send", rs485.delay_after_send)}) {
    if (delay % 1ms != Duration::zero()) {
      problems.Error(keys.MarkOf(key),
                     std::string(key) + ": the driver knows whole milliseconds only");
    }
  }
}

void CheckDataBits(const SerialSettings& serial, const Protocol& protocol, const Mark& mark,
                   Problems& problems) {
  if (serial.xonxoff && protocol.data_bits == 8) {
    problems.Error(mark, "xonxoff: " + std::string(protocol.name) +
                             " sends every byte, and XON/XOFF takes 0x11 and 0x13 out; use rtscts, "
                             "or remove the key");
  }
  if (serial.data_bits >= protocol.data_bits) return;
  SerialSettings wide = serial;
  wide.data_bits = 8;
  problems.Error(mark, "serial: " + std::string(protocol.name) + " needs 8 data bits, and " +
                           serial.ToString() + " has 7; write for example " + wide.ToString());
}

void CheckPortSettings(const std::string& port, const SerialSettings& serial, const Mark& mark,
                       Problems& problems) {
  if (!port.starts_with("tcp://")) return;
  for (const auto& [key, used] :
       {std::pair("rs485", serial.rs485.enabled), std::pair("rtscts", serial.rtscts),
        std::pair("xonxoff", serial.xonxoff)}) {
    if (!used) continue;
    problems.Error(mark, std::string(key) +
                             ": a serial server (tcp://) does this by itself; set it there and "
                             "remove the key");
  }
}

void CheckTcp(const Protocol& protocol, const std::string& port, const Keys& keys,
              Problems& problems) {
  if (!protocol.tcp) return;
  const std::string name(protocol.name);
  if (!port.empty() && !port.starts_with("tcp://")) {
    const std::string other(protocol.profiles_of);
    problems.Error(keys.MarkOf(keys.Has("port") ? "port" : "protocol"),
                   "port: " + port + " is a serial port, and " + name +
                       " is spoken over TCP; write port: tcp://host:502" +
                       (other.empty() ? "" : ", or protocol: " + other + " for a serial line"));
  }
  for (const char* const key : {"serial", "parity", "rs485", "echo"}) {
    if (!keys.Has(key)) continue;
    problems.Error(keys.MarkOf(key),
                   std::string(key) + ": " + name + " has no serial line; remove the key");
  }
}

}  // namespace baudgate::config
