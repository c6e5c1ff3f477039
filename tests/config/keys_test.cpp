// Tests that docs/keys.md contains the keys of the configuration (config/model/fields.h). A table
// stands between `<!-- keys: NAME -->` and the next empty line. The man page is made from that file
// (packaging/man/pages.py). To write the tables again:
//
//     BAUDGATE_WRITE_DOCS=1 build/release/tests/config_test --gtest_filter='Keys*'
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>

#include "config/model/config.h"
#include "config/yaml/yaml_source.h"
#include "gateway/base/decimal.h"
#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

std::string ValueText(bool value) { return value ? "true" : "false"; }
std::string ValueText(Duration value) { return FormatDuration(value); }
std::string ValueText(const Decimal& value) { return value.ToText(); }
std::string ValueText(const HostPort& at) { return HostAndPort(at.host, at.port); }
std::string ValueText(const std::string& text) { return text; }
std::string ValueText(const std::vector<std::string>& texts) {
  return Join(std::vector<std::string_view>(texts.begin(), texts.end()));
}
template <std::integral T>
std::string ValueText(T value) {
  return std::to_string(value);
}

template <auto kMember, typename T>
std::string DefaultOf(const Field<kMember>& field, const T& value) {
  if constexpr (std::is_enum_v<T> || std::same_as<T, bool>) {
    for (const auto& one : field.words) {
      if (one.meaning == value) return std::string(one.word);
    }
  }
  if constexpr (requires { ValueText(value); }) return ValueText(value);
  return {};
}
template <auto kMember, typename T>
std::string DefaultOf(const Field<kMember>& field, const std::optional<T>& value) {
  return value ? DefaultOf(field, *value) : std::string();
}

template <auto kMember>
std::string AllowedOf(const Field<kMember>& field) {
  std::vector<std::string_view> words;
  for (const auto& one : field.words) words.push_back(one.word);
  if (!words.empty()) return Join(words);
  if (!(field.least < field.most)) return {};
  return ValueText(field.least) + "…" + ValueText(field.most);
}

/// Returns the table of the keys that begin with `prefix`. Example: "gateway." for "gateway.name".
template <HasFields T>
std::string TableOf(const T& its, std::string_view prefix = "") {
  std::string text = "| key | default | allowed | |\n| --- | --- | --- | --- |\n";
  VisitFields(&its, [&](const auto& field) {
    const std::size_t start = field.key.rfind('.') + 1;
    if constexpr (requires { field.help; }) {
      if (field.help.empty() || field.key.substr(0, start) != prefix) return;
      std::string fallback(field.fallback);
      std::string allowed;
      if constexpr (requires { field.member; }) {
        if (fallback.empty()) fallback = DefaultOf(field, its.*field.member);
        allowed = AllowedOf(field);
      } else {
        allowed = field.allowed;
      }
      text += "| `" + std::string(field.key.substr(start)) + "` |";
      for (const std::string& cell : {fallback, allowed, std::string(field.help)}) {
        text += (cell.empty() ? "" : " " + cell) + " |";
      }
      text += "\n";
    }
  });
  return text;
}

std::map<std::string, std::string> Tables() {
  Pace pace;
  pace.poll = Device().poll;
  pace.slow = Device().slow;
  pace.daily = Device().daily;
  pace.retries = Line().retries;
  return {
      {"top", TableOf(Config())},
      {"gateway", TableOf(Config(), "gateway.")},
      {"alarms", TableOf(AlarmSetting())},
      {"modbus", TableOf(Modbus())},
      {"listener", TableOf(Listener())},
      {"client", TableOf(ClientPriority())},
      {"function", TableOf(FunctionPriority())},
      {"route", TableOf(Route())},
      {"dds", TableOf(Dds())},
      {"security", TableOf(DdsSecurity())},
      {"mqtt", TableOf(Mqtt())},
      {"remote_write", TableOf(RemoteWrite())},
      {"web", TableOf(Web())},
      {"history", TableOf(History())},
      {"history_point", TableOf(HistoryPoint())},
      {"events", TableOf(Events())},
      {"point", TableOf(Point())},
      {"writing", TableOf(Writing())},
      {"allow_when", TableOf(AllowWhen())},
      {"point_event", TableOf(PointEvent())},
      {"device_event", TableOf(EventText())},
      {"times", TableOf(pace)},
      {"timing", TableOf(Timing())},
      {"line", TableOf(Line())},
      {"device", TableOf(Device())},
      {"profile", TableOf(Profile())},
      {"serial", TableOf(SerialSettings())},
      {"rs485", TableOf(Rs485())},
      {"serial_server", TableOf(PortServer())},
  };
}

TEST(Keys, AreDocumentedAsInTheProgram) {
  const std::string file = "docs/keys.md";
  const std::string document = ReadWholeFile(file).value();
  auto tables = Tables();
  std::string filled;
  std::size_t at = 0;
  const std::string mark = "<!-- keys: ";
  for (std::size_t next = 0; (next = document.find(mark, at)) != std::string::npos;) {
    const std::size_t end = document.find('\n', next) + 1;
    const std::string name =
        document.substr(next + mark.size(), document.find(" -->", next) - next - mark.size());
    ASSERT_TRUE(tables.contains(name)) << name;
    filled += document.substr(at, end - at) + tables[name];
    tables.erase(name);
    at = std::min(document.find("\n\n", end - 1), document.size() - 1) + 1;
  }
  filled += document.substr(at);
  for (const auto& [name, table] : tables) ADD_FAILURE() << name << " stands nowhere";
  if (std::getenv("BAUDGATE_WRITE_DOCS") != nullptr) std::ofstream(file) << filled;
  EXPECT_TRUE(document == filled) << file
                                  << " differs from the rows; the head of this file says how to "
                                     "write it anew";
}

}  // namespace
}  // namespace baudgate::config
