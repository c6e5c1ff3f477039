// The fixture of the system tests: a directory of its own, a free port, a DDS domain, device
// profiles with fixed values, twins made by `baudgate simulate` and the daemon that reads them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/system/child.h"
#include "tests/system/codes.h"
#include "tests/system/modbus_client.h"

namespace baudgate::system_test {

using Json = nlohmann::json;

/// By point: what the twin gives, as it stands behind `simulate:`.
using FixedValues = std::map<std::string, std::string>;

class Station : public testing::Test {
 protected:
  Station();
  ~Station() override;

  // ---- files
  const std::filesystem::path& directory() const { return directory_; }
  std::filesystem::path Write(const std::string& name, const std::string& text) const;
  /// A copy of a shipped profile under another name. Points that are not given and would swing
  /// between two values stand still at the lower one.
  void PinProfile(const std::string& protocol, const std::string& shipped, const std::string& name,
                  const FixedValues& values) const;

  // ---- configuration
  std::uint16_t port() const { return port_; }
  int domain() const { return domain_; }
  const std::string& gateway() const { return gateway_; }
  std::string LinkOf(const std::string& line) const { return (directory_ / line).string(); }
  /// The control socket of WithSocket().
  std::string socket() const { return LinkOf("gate.sock"); }
  /// `yaml`, whose gateway has that socket, and `keys` besides: "state: /tmp/x, ".
  std::string WithSocket(std::string yaml, const std::string& keys = {}) const;
  /// Head of a configuration; lines follow.
  std::string Head(bool dds = false) const;
  /// One line on the pty of that name, with one device "NAME-1" described by `keys`.
  std::string Line(const std::string& name, const std::string& protocol, const std::string& keys,
                   const std::string& line_keys = {}) const;

  // ---- processes
  Child::Environment Environment() const;
  std::unique_ptr<Child> Start(std::vector<std::string> words,
                               Child::Environment more = {}) const;  ///< of baudgate
  Finished Command(std::vector<std::string> words) const;            ///< of baudgate
  Finished Ask(std::vector<std::string> words) const;                ///< of baudgate, over socket()
  /// `status --json` over socket(), of a line or a device if it is named.
  Json Status(const std::string& target = {}) const;
  /// A twin on the pty of `line`, once it can be opened.
  std::unique_ptr<Child> StartTwin(const std::string& line, const std::string& profile,
                                   const std::string& address,
                                   const std::vector<std::string>& more = {}) const;
  /// `baudgate run`, once its Modbus port answers.
  std::unique_ptr<Child> StartDaemon(const std::string& yaml) const;

  // ---- expectations
  bool EventuallyFloat(ModbusClient& client, int unit, int address, float value) const;
  bool EventuallyQuality(ModbusClient& client, int unit, int address, int quality) const;
  bool EventuallyLogged(const Child& child, const std::string& text) const;

 private:
  std::filesystem::path directory_;
  std::uint16_t port_;
  int domain_;
  std::string gateway_;
};

/// A document for each whole line.
std::vector<Json> JsonLines(const std::string& output);

/// The first child of a process; 0 while there is none.
pid_t ChildOf(const Child& process);

/// A port of loopback that nobody listens on and no other test has, below the range that the kernel
/// gives to clients.
std::uint16_t FreePort();

/// A DDS domain, 1 to 99, that no other test has: another one at each call, because the gateway of
/// the test before may still say in its domain that it ends. The domain of the call before is free
/// again.
int FreeDomain();

}  // namespace baudgate::system_test
