// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/live/port_config.h"

#include "config/loader.h"

namespace baudgate {
namespace {

constexpr std::size_t kLongestName = 40;

}  // namespace

std::string YamlText(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  return quoted + "\"";
}

std::string NameOfPort(const std::string& port) {
  const auto slash = port.find_last_of('/');
  std::string name;
  for (const char c : slash == std::string::npos ? port : port.substr(slash + 1)) {
    const bool word = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    if (word) {
      name += c;
    } else if (!name.empty() && name.back() != '-') {
      name += '-';
    }
    if (name.size() == kLongestName) break;
  }
  while (name.ends_with('-')) name.pop_back();
  return name.empty() ? "port" : name;
}

Result<config::Config> PortConfig(const std::string& yaml, const config::Catalog& catalog) {
  config::Loaded loaded = config::LoadText(yaml, "command line", catalog);
  if (loaded.ok()) return std::move(loaded.config);
  std::string all;
  for (const config::Problem& problem : loaded.problems) {
    if (!problem.warning) all += (all.empty() ? "" : "\n") + problem.message;
  }
  return Error{all};
}

}  // namespace baudgate
