// A port that records all calls, for tests of the server of a port.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "transports/transport.h"

namespace baudgate::test {

class FakePort final : public transports::Transport {
 public:
  void Open() override { open = true; }
  void Close() override { open = false; }
  bool is_open() const override { return open; }
  void Send(View bytes) override {
    Append(sent, bytes);
    if (!takes) unsent += bytes.size();
  }
  void DropUnsent() override { unsent = 0; }
  Status Apply(const config::SerialSettings& wanted) override {
    calls.push_back("apply " + wanted.ToString() + (wanted.rtscts ? " rtscts" : "") +
                    (wanted.xonxoff ? " xonxoff" : "") +
                    (wanted.software_parity ? " software" : ""));
    if (!refused.empty() && wanted.ToString().find(refused) != std::string::npos) {
      return Error{"refused"};
    }
    serial = wanted;
    return {};
  }
  Status Reset(const config::SerialSettings& wanted) override {
    unsent = 0;
    paused = false;
    calls.push_back("reset");
    serial = wanted;
    return reset;
  }
  void Pause(bool on) override { paused = on; }
  std::size_t Unsent() const override { return unsent; }
  void Purge(bool input, bool output) override {
    calls.push_back(std::string("purge") + (input ? " input" : "") + (output ? " output" : ""));
  }
  std::optional<ModemLines> ReadModemLines() const override { return modem; }
  Status Set(transports::PortSwitch which, bool on) override {
    constexpr const char* kNames[] = {"dtr", "rts", "break"};
    if (no_switches) return Error{"no such line"};
    calls.push_back(std::string(kNames[static_cast<int>(which)]) + (on ? " on" : " off"));
    return {};
  }
  transports::PortCounters Counters() const override { return counters; }
  std::string Describe() const override { return "fake"; }

  bool open = true;
  bool takes = true;
  std::size_t unsent = 0;
  bool paused = false;
  bool no_switches = false;
  std::string refused;
  Status reset;
  Bytes sent;
  std::vector<std::string> calls;
  config::SerialSettings serial;
  std::optional<ModemLines> modem;
  transports::PortCounters counters;
};

}  // namespace baudgate::test
