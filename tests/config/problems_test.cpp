// Every problem of a configuration: the exact place and sentence of each stands in problems.txt.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "config/loader.h"
#include "config/profile.h"
#include "tests/config/fake_protocol.h"
#include "tests/config/shipped.h"

namespace baudgate::testing {
namespace {

/// One of problems.txt, whose head explains the signs.
struct ProblemCase {
  int line;
  std::string catalog;
  std::string form;
  std::string written;
  std::vector<std::pair<char, std::string>> said{};
};

std::vector<ProblemCase> ReadCases() {
  std::ifstream file("tests/config/problems.txt");
  std::vector<ProblemCase> cases;
  std::string catalog;
  std::string form;
  bool in_form = false;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (line.empty() || line[0] == '#') continue;
    const std::string rest = line.size() > 2 ? line.substr(2) : "";
    if (line[0] == '@') {
      catalog = rest;
      form.clear();
      in_form = true;
    } else if (line[0] == '-') {
      cases.push_back({number, catalog, form, rest});
      in_form = false;
    } else if (line[0] != '|') {
      cases.back().said.emplace_back(line[0], rest);
    } else if (in_form) {
      form += rest + "\n";
    } else {
      cases.back().written += "\n" + rest;
    }
  }
  return cases;
}

/// The document with each part of what is written at its place.
std::string DocumentOf(const ProblemCase& one) {
  const std::string place = "§";
  std::string text = one.form;
  std::size_t at = 0;
  for (std::string left = one.written;;) {
    const std::size_t end = left.find(place);
    const std::string part = left.substr(0, end);
    at = text.find(place, at);
    EXPECT_NE(at, std::string::npos) << "more parts than places";
    if (at == std::string::npos) return text;
    text.replace(at, place.size(), part);
    at += part.size();
    if (end == std::string::npos) break;
    left.erase(0, end + place.size());
  }
  while ((at = text.find(place, at)) != std::string::npos) text.erase(at, place.size());
  return text;
}

std::string ProblemsOf(const std::string& catalog, const std::string& document) {
  if (catalog == "profile") {
    static const Protocol kProtocol = MakeFakeProtocol("fake");
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

/// Without the lines that begin with `prefix`.
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

TEST(Problems, AreSaidAsInTheTable) {
  const auto cases = ReadCases();
  EXPECT_GT(cases.size(), 500U);
  for (const ProblemCase& one : cases) {
    SCOPED_TRACE("tests/config/problems.txt:" + std::to_string(one.line) + ": " + one.written);
    const std::string ignored = " without ";
    const std::size_t end = one.catalog.find(ignored);
    std::string problems = ProblemsOf(one.catalog.substr(0, end), DocumentOf(one));
    if (end != std::string::npos) {
      problems = Without(one.catalog.substr(end + ignored.size()), problems);
    }
    EXPECT_FALSE(one.said.empty());
    std::string whole;
    for (const auto& [sign, text] : one.said) {
      const bool found = problems.find(text) != std::string::npos;
      const bool alone = std::count(problems.begin(), problems.end(), '\n') == 1;
      if (sign == '=') whole += text.empty() ? "" : text + "\n";
      const bool right = sign == '='   ? true
                         : sign == '~' ? found && !problems.empty()
                         : sign == '^' ? found && alone
                                       : sign == '!' && !found;
      EXPECT_TRUE(right) << sign << " " << text << "\n" << problems;
    }
    if (one.said[0].first == '=') {
      EXPECT_EQ(problems, whole);
    }
  }
}

TEST(LineErrors, ALineWhoseProtocolIsMisspeltIsCheckedAsTheOneThatIsMeant) {
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

TEST(GatewayErrors, AProfileIsJudgedOnceHoweverItsPathIsWritten) {
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
