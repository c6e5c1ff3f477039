// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/printed/printed_script.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string_view>

#include "gateway/base/text.h"

namespace baudgate::protocols {
namespace {

PrintedPart PartOf(std::string_view text) {
  PrintedPart part;
  for (const std::string_view word : Split(Trim(text), ' ')) {
    const auto equals = word.find('=');
    if (equals == std::string_view::npos) continue;
    part.options.emplace_back(word.substr(0, equals), word.substr(equals + 1));
  }
  return part;
}

bool Take(std::string_view line, int number, std::vector<PrintedPart>& parts) {
  constexpr std::string_view kSet = "set:";
  if (line.starts_with(kSet)) {
    parts.push_back(PartOf(line.substr(kSet.size())));
    return true;
  }
  if (parts.empty()) parts.emplace_back();
  auto& exchanges = parts.back().exchanges;
  const std::string text(Trim(line.substr(1)));
  if (line.front() == '>') {
    exchanges.push_back({number, text, std::nullopt, {}, "ok"});
    return true;
  }
  if (exchanges.empty()) return false;
  PrintedExchange& exchange = exchanges.back();
  switch (line.front()) {
    case '<':
      if (exchange.reply) return false;
      exchange.reply = text;
      return true;
    case '=':
      exchange.values.push_back(text);
      return true;
    case '!':
      exchange.outcome = text;
      return true;
    default:
      return false;
  }
}

}  // namespace

std::vector<PrintedPart> ReadPrintedScript(const std::string& path) {
  std::vector<PrintedPart> parts;
  std::ifstream in(path);
  EXPECT_TRUE(in.good()) << "cannot be read: " << path;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.empty() || line.front() == '#') continue;
    EXPECT_TRUE(Take(line, number, parts)) << path << ":" << number << ": " << line;
  }
  return parts;
}

}  // namespace baudgate::protocols
