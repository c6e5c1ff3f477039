// The fixture of reload tests: a gateway with three simulated devices, whose file is changed while
// it runs.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/system/three_devices.h"

namespace baudgate::system_test {

inline std::string Replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

class Reload : public ThreeDevices {
 protected:
  std::filesystem::path file() const { return directory() / "baudgate.yaml"; }
  std::string YamlWithSocket(bool dds = false) const { return WithSocket(Yaml(dds)); }
  std::filesystem::path ConfirmedCopy() const {
    return directory() / "state" / gateway() / "configurations/confirmed.yaml";
  }
  std::string WithSlowerIo() const {
    return Replaced(YamlWithSocket(), "unit: 11, poll: 200ms", "unit: 11, poll: 300ms");
  }
  void SetFile(const std::string& yaml) const { Station::Write("baudgate.yaml", yaml); }

  static Json LineOf(const Json& status, const std::string& name) {
    for (const Json& line : status["lines"]) {
      if (line["name"] == name) return line;
    }
    return {};
  }
  bool RunsSlower() const {
    const auto io = Ask({"reload", "--dry-run"}).output;
    return io.find("nothing has changed") != std::string::npos;
  }
};

}  // namespace baudgate::system_test
