// `Station` is the fixture of the system tests: a directory, a free port, a DDS domain, profiles
// with fixed values, simulated devices (`baudgate simulate`), and the daemon that reads them.
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

/// The values of a simulated device by the name of the point, as written behind `simulate:`.
using FixedValues = std::map<std::string, std::string>;

class Station : public testing::Test {
 protected:
  Station();
  ~Station() override;

  const std::filesystem::path& directory() const { return directory_; }
  std::filesystem::path Write(const std::string& name, const std::string& text) const;
  /// Copies a shipped profile as `name`. The points in `values` get these fixed values; all other
  /// varying values are fixed at their lower end.
  void PinProfile(const std::string& protocol, const std::string& shipped, const std::string& name,
                  const FixedValues& values) const;

  std::uint16_t port() const { return port_; }
  int domain() const { return domain_; }
  const std::string& gateway() const { return gateway_; }
  std::string LinkOf(const std::string& line) const { return (directory_ / line).string(); }
  std::string socket() const { return LinkOf("gate.sock"); }
  /// Adds socket() and `keys` to the gateway of `yaml`. Example of `keys`: "state: /tmp/x, ".
  std::string WithSocket(std::string yaml, const std::string& keys = {}) const;
  std::string Head(bool dds = false) const;
  /// Returns a line on the pty of that name, with one device "NAME-1" described by `keys`.
  std::string Line(const std::string& name, const std::string& protocol, const std::string& keys,
                   const std::string& line_keys = {}) const;

  Child::Environment Environment() const;
  std::unique_ptr<Child> Start(std::vector<std::string> words, Child::Environment more = {}) const;
  Finished Command(std::vector<std::string> words) const;
  Finished Ask(std::vector<std::string> words) const;
  Json Status(const std::string& target = {}) const;
  std::unique_ptr<Child> StartTwin(const std::string& line, const std::string& profile,
                                   const std::string& address,
                                   const std::vector<std::string>& more = {}) const;
  /// Starts `baudgate run` and waits until its Modbus port answers.
  std::unique_ptr<Child> StartDaemon(const std::string& yaml) const;

  bool EventuallyFloat(ModbusClient& client, int unit, int address, float value) const;
  bool EventuallyQuality(ModbusClient& client, int unit, int address, int quality) const;
  bool EventuallyLogged(const Child& child, const std::string& text) const;

 private:
  std::filesystem::path directory_;
  std::uint16_t port_;
  int domain_;
  std::string gateway_;
};

std::vector<Json> JsonLines(const std::string& output);

pid_t ChildOf(const Child& process);

/// Returns a loopback port that no other test uses, below the range of client ports.
std::uint16_t FreePort();

/// Returns a DDS domain, 1 to 99, that no other test uses. Each call returns another domain,
/// because the previous gateway can still announce its end.
int FreeDomain();

}  // namespace baudgate::system_test
