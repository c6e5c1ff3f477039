// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/offline/one_device.h"

#include <fmt/format.h>

#include "config/loader.h"
#include "gateway/base/text.h"

namespace baudgate {
namespace {

/// As a double-quoted YAML scalar, so that no word of the command line is taken for structure.
std::string Quoted(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

Result<std::string> ProtocolOf(const OneDevice& wanted, const config::Catalog& catalog) {
  if (!wanted.protocol.empty()) return wanted.protocol;
  std::string found;
  for (const config::ProfileFile& file : catalog.Profiles()) {
    if (file.name == wanted.profile) found = file.protocol;
  }
  if (!found.empty()) return found;
  if (wanted.profile.find('/') != std::string::npos || wanted.profile.ends_with(".yaml")) {
    return Error{"a profile given by its path needs --protocol"};
  }
  return Error{"no profile named '" + wanted.profile + "'; `baudgate profiles` lists them"};
}

}  // namespace

Result<config::Config> MakeOneDevice(const OneDevice& wanted, const config::Catalog& catalog) {
  const auto protocol = ProtocolOf(wanted, catalog);
  if (!protocol) return Error{protocol.error()};
  std::string yaml = "modbus: { enabled: false }\ndds: { enabled: false }\nlines:\n";
  yaml += fmt::format("  - name: line\n    port: /dev/null\n    protocol: {}\n", Quoted(*protocol));
  if (!wanted.serial.empty()) yaml += fmt::format("    serial: {}\n", Quoted(wanted.serial));
  yaml += fmt::format("    devices:\n      - name: device\n        address: {}\n",
                      Quoted(wanted.address));
  if (!wanted.profile.empty()) yaml += fmt::format("        profile: {}\n", Quoted(wanted.profile));
  for (const std::string& setting : wanted.set) {
    const auto equals = setting.find('=');
    if (equals == std::string::npos) return Error{"--set: write key=value"};
    // Unquoted, because the loader tells true from "true"; a new line could only add keys, and
    // those are checked like all others.
    yaml += fmt::format("        {}: {}\n", setting.substr(0, equals), setting.substr(equals + 1));
  }
  const config::Loaded loaded = config::LoadText(yaml, "command line", catalog);
  if (loaded.ok()) return loaded.config;
  std::string message;
  for (const config::Problem& problem : loaded.problems) {
    if (problem.warning) continue;
    message += (message.empty() ? "" : "\n") + problem.message;
  }
  return Error{message};
}

}  // namespace baudgate
