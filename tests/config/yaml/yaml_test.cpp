// Tests the YAML reader: syntax errors, encodings, size, nesting, aliases, columns.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/loader.h"
#include "gateway/base/text.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

TEST(Yaml, SyntaxErrorIsOneProblemWithItsPlace) {
  EXPECT_EQ(Shown(Load("lines:\n- name: l\n port: x\n").problems),
            "t.yaml:3:2: error: this is not YAML: end of sequence not found\n");
}

TEST(Yaml, UnquotedHashInAFlowMapGetsAHint) {
  EXPECT_EQ(Shown(Load("lines:\n- { name: l, points: [{ name: p, read: #[0], type: int16 }] }\n"
                       "# end\n")
                      .problems),
            "t.yaml:4:1: error: this is not YAML: end of map flow not found; the value after "
            "'read:' in line 2 begins with '#' and needs quotes\n");
}

TEST(Yaml, UnquotedHashInABlockMapGetsAHint) {
  const auto loaded = Load(
      "lines:\n- name: l\n  port: /dev/l\n  protocol: fake\n  devices:\n"
      "  - name: d\n    address: 1\n    points:\n"
      "    - name: p\n      type: int16\n      read: #[0]\n");
  EXPECT_EQ(Shown(loaded.problems),
            "t.yaml:11:7: error: read: has no value; text after '#' is a comment; put a value that "
            "begins with '#' in quotes\n");
}

TEST(Yaml, AnUnquotedPasswordThatLooksLikeAnAliasIsNotShown) {
  const std::string problems = Shown(Load("lines:\n- password: *hunter2\n").problems);
  EXPECT_EQ(problems,
            "t.yaml:2:13: error: this is not YAML: the referenced anchor is not defined; the value "
            "after 'password:' in line 2 begins with '*' and needs quotes\n");
}

TEST(Yaml, EmptyTextsAndSeveralDocumentsAreRefused) {
  EXPECT_EQ(Shown(Load("").problems), "t.yaml:1:1: error: is empty\n");
  EXPECT_EQ(Shown(Load("# nothing\n").problems), "t.yaml:1:1: error: is empty\n");
  EXPECT_EQ(Shown(Load("lines: []\n---\ngateway: {}\n").problems),
            "t.yaml:2:1: error: a second document begins here, but a file can have only one; "
            "remove the '---'\n");
  EXPECT_EQ(Shown(Load("- a\n").problems),
            "t.yaml:1:1: error: the configuration: expected a map (key: value), found a list\n");
}

// The YAML library would return documents endlessly for a text with a comma behind its document, so
// the reader must refuse the text.
TEST(Yaml, ACommaAfterTheDocumentIsRefused) {
  const std::string advice = " error: this comma is outside of brackets; remove it\n";
  EXPECT_EQ(Shown(Load("{ lines: [] },\n").problems), "t.yaml:1:14:" + advice);
  EXPECT_EQ(Shown(Load("[1], 2\n").problems), "t.yaml:1:4:" + advice);
  EXPECT_EQ(Shown(Load("- a\n, b\n").problems), "t.yaml:2:1:" + advice);
  EXPECT_EQ(Shown(Load(",").problems), "t.yaml:1:1:" + advice);
}

TEST(Yaml, OtherEncodingsAreRefused) {
  EXPECT_EQ(Shown(Load("gateway:\n  name: \xFFx\n").problems),
            "t.yaml:2:1: error: this line is not UTF-8 text; save the file as UTF-8\n");
  EXPECT_EQ(Shown(Load(std::string("l\0i\0", 4)).problems),
            "t.yaml:1:1: error: this line is not UTF-8 text; save the file as UTF-8\n");
}

TEST(Yaml, ColumnsCountCharacters) {
  EXPECT_EQ(ProblemsOfPoint("name: p, read: A1, unit: \"°C\", type: int17").substr(0, 14),
            "t.yaml:8:50: e");
}

TEST(Yaml, LargeAndDeepTextsAreRefused) {
  EXPECT_EQ(Shown(Load(std::string((4U << 20U) + 1, ' ')).problems),
            "t.yaml: error: is larger than the 4 MiB that a configuration can have; divide the "
            "devices among several gateways\n");
  for (const char* const bracket : {"[", "{a: ", "- ", "? "}) {
    std::string deep = "lines: \n ";
    for (int i = 0; i < 100'000; ++i) deep += bracket;
    const auto loaded = Load(deep);
    EXPECT_EQ(loaded.problems.size(), 1U) << bracket;
    EXPECT_FALSE(loaded.ok()) << bracket;
  }
}

TEST(Yaml, TextsWithTooManyNodesAreRefused) {
  const auto refused = [](const std::string& text) {
    const std::string shown = Shown(Load(text).problems);
    return shown.starts_with("t.yaml: error: has more than 200000 keys and values");
  };
  EXPECT_TRUE(refused(std::string(200'001, '['))) << "before the first token is stored";
  std::string lines;
  for (int i = 0; i < 200'001; ++i) lines += "- a\n";
  EXPECT_TRUE(refused(lines));
  std::string few = "# ";
  few += std::string(100'000, '[') + "\nlines: []\n";
  EXPECT_FALSE(refused(few));
}

TEST(Yaml, AliasesWorkAndAreLimited) {
  const auto good = Load(
      "lines:\n"
      "- { name: l, port: /dev/l, protocol: fake, timing: &t { reply: 1s },\n"
      "    devices: [{ name: d, address: 1, profile: relay, timing: *t }] }\n");
  EXPECT_EQ(Shown(good.problems), "");
  EXPECT_EQ(good.config.lines[0].devices[0].timing.reply, 1s);
  EXPECT_FALSE(Load("lines: &a [*a, *a]\n").ok());
  std::string bomb =
      "lines:\n- &l { name: l, port: /dev/l, protocol: fake, devices: [&d { name: d, ";
  bomb += "address: 1, points: [&p { name: p, read: A1, type: int16 }";
  for (int i = 0; i < 300; ++i) bomb += ", *p";
  bomb += "] }";
  for (int i = 0; i < 300; ++i) bomb += ", *d";
  bomb += "] }\n";
  for (int i = 0; i < 30; ++i) bomb += "- *l\n";
  const auto loaded = Load(bomb);
  EXPECT_FALSE(loaded.ok());
  EXPECT_LE(loaded.problems.size(), config::Problems::kMost + 1);
}

TEST(Yaml, ControlCharactersDoNotReachTheTerminal) {
  EXPECT_EQ(Shown(Load("lines: []\n\"a\\e[2Jb\": 1\n").problems),
            "t.yaml:2:1: error: unknown key 'a…' in the configuration; allowed: gateway, events, "
            "history, "
            "modbus, dds, mqtt, remote_write, users, web, lines\n");
  EXPECT_EQ(Shown(Load("lines: []\ndds: { enabled: \"a\\e[2Jb\" }\n").problems),
            "t.yaml:2:17: error: enabled: 'a\\x1B[2Jb' is neither true nor false\n");
}

TEST(Spelling, NearestIsWithinAThirdOfTheWord) {
  const std::vector<std::string_view> words = {"address", "enabled", "unit"};
  EXPECT_EQ(Nearest("adress", words), "address");
  EXPECT_EQ(Nearest("untit", words), "unit");
  EXPECT_EQ(Nearest("uint", words), "unit");
  EXPECT_EQ(Nearest("x", words), "");
  EXPECT_EQ(Nearest("dress code", words), "");
}

}  // namespace
}  // namespace baudgate::testing
