// Tests position and text of every problem of a configuration, as listed in
// tests/config/problems.txt.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "config/loader.h"
#include "config/profile.h"
#include "tests/config/fake_protocol.h"
#include "tests/config/shipped.h"
#include "tests/support/file_cases.h"

namespace baudgate::testing {
namespace {

std::string Joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

std::string DocumentOf(const std::string& form, std::string written) {
  const std::string place = "§";
  std::string text = form;
  std::size_t at = 0;
  for (bool last = false; !last;) {
    const std::size_t end = written.find(place);
    last = end == std::string::npos;
    const std::string part = written.substr(0, end);
    at = text.find(place, at);
    EXPECT_NE(at, std::string::npos) << "more parts than places";
    if (at == std::string::npos) return text;
    text.replace(at, place.size(), part);
    at += part.size();
    if (!last) written.erase(0, end + place.size());
  }
  while ((at = text.find(place, at)) != std::string::npos) text.erase(at, place.size());
  return text;
}

std::string ProblemsOf(const std::string& catalog, const std::string& document) {
  if (catalog == "profile") {
    static const protocols::Protocol kProtocol = MakeFakeProtocol("fake");
    config::Problems problems;
    config::ReadProfileText(document, "p.yaml", "p", kProtocol, problems);
    return Shown(problems.Sorted());
  }
  const config::Loaded loaded = config::LoadText(document, "t.yaml",
                                                 catalog == "shipped"  ? Shipped()
                                                 : catalog == "modbus" ? ModbusCatalog()
                                                                       : FakeCatalog());
  const std::string problems = Shown(loaded.problems);
  EXPECT_EQ(loaded.ok(), problems.find(": error: ") == std::string::npos) << problems;
  return problems;
}

std::string Without(const std::string& prefix, std::string problems) {
  for (std::size_t at = 0; at < problems.size();) {
    const std::size_t size = problems.find('\n', at) + 1 - at;
    if (problems.compare(at, prefix.size(), prefix) == 0) {
      problems.erase(at, size);
    } else {
      at += size;
    }
  }
  return problems;
}

/// The head of tests/config/problems.txt explains the notation of the table.
TEST(Problems, AreReportedAsInTheTable) {
  const auto cases = ReadFileCases("tests/config/problems.txt");
  EXPECT_GT(cases.size(), 500U);
  for (const FileCase& one : cases) {
    std::string written = Joined(one.given);
    written.pop_back();
    SCOPED_TRACE(one.place + ": " + written);
    const std::string without = " without ";
    const std::size_t end = one.head.find(without);
    std::string problems =
        ProblemsOf(one.head.substr(0, end), DocumentOf(Joined(one.form), written));
    if (end != std::string::npos) {
      problems = Without(one.head.substr(end + without.size()), problems);
    }
    const bool alone = std::count(problems.begin(), problems.end(), '\n') == 1;
    ASSERT_FALSE(one.results.empty());
    std::string whole;
    for (const auto& [sign, text] : one.results) {
      const bool found = problems.find(text) != std::string::npos;
      if (sign == '=' && !text.empty()) whole += text + "\n";
      const bool right = sign == '='   ? true
                         : sign == '~' ? found && !problems.empty()
                         : sign == '^' ? found && alone
                                       : sign == '!' && !found;
      EXPECT_TRUE(right) << sign << " " << text << "\n" << problems;
    }
    if (one.results[0].first == '=') {
      EXPECT_EQ(problems, whole);
    }
  }
}

TEST(LineErrors, ALineWithAMisspeltProtocolIsCheckedByTheLikelyProtocol) {
  const std::string rest =
      ", port: /dev/l, serial: 9600 8N1,\n"
      "    devices: [{ name: d, address: 7x, profile: relay, write: [setting], identity: ignore,\n"
      "                ratios: { V: 400 V }, checksum: on, unit: 3 },\n"
      "              { name: e, address: 2, write: [b],\n"
      "                points: [{ name: a, read: A1, type: int16, write: A1, access: rw },\n"
      "                         { name: b, read: A2, type: int16, write: A2, access: rw }] }] }\n"
      "history: { points: [\"l.d.current_*\"] }\n"
      "modbus: { routes: [{ units: 20, line: l }] }\n";
  const std::string misspelt =
      "t.yaml:2:24: error: protocol: 'FAKE' is not installed; did you mean 'fake'? "
      "installed: fake, other\n";
  EXPECT_EQ(Shown(Load("lines:\n- { name: l, protocol: FAKE" + rest).problems),
            misspelt + Shown(Load("lines:\n- { name: l, protocol: fake" + rest).problems));
  EXPECT_NE(Shown(Load("lines:\n- { name: l, protocol: fake" + rest).problems), "");
  EXPECT_EQ(Shown(Load("lines:\n- { name: l, protocol: telex" + rest).problems),
            "t.yaml:2:24: error: protocol: 'telex' is not installed; installed: fake, other\n")
      << "nobody knows what the rest would mean";
}

TEST(GatewayErrors, AProfileIsCheckedOnceHoweverItsPathIsWritten) {
  const std::string devices =
      "lines:\n"
      "- name: l\n"
      "  port: /dev/l\n"
      "  protocol: fake\n"
      "  devices:\n";
  const std::string one =
      Shown(Load(devices +
                 "  - { name: d, address: 1, profile: tests/config/profiles/fake/broken.yaml }\n")
                .problems);
  const std::string both =
      Shown(Load(devices +
                 "  - { name: d, address: 1, profile: tests/config/profiles/fake/broken.yaml }\n"
                 "  - { name: e, address: 2, profile: tests/config/./profiles/fake/broken.yaml }\n"
                 "  - { name: f, address: 3, profile: broken }\n")
                .problems);
  EXPECT_EQ(one, both);
  EXPECT_NE(one.find("t.yaml:6:37: error: profile: 'broken' of device 'd' has errors"),
            std::string::npos)
      << one;
}

}  // namespace
}  // namespace baudgate::testing
