// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/make_line.h"

#include "config/catalog/option_values.h"
#include "config/checks/device_checks.h"
#include "config/checks/line_checks.h"
#include "config/lines.h"
#include "config/loader.h"
#include "gateway/base/text.h"

namespace baudgate::tools {
namespace {

using config::Device;
using config::Line;
using config::Mark;
using config::Problems;

const Mark kCommandLine = {"command line", 0, 0};

config::Profile ReadProfile(const std::string& name, const protocols::Protocol& protocol,
                            const config::Catalog& catalog, Problems& problems) {
  if (name.empty()) return {};
  config::LoadedProfile loaded = config::LoadProfile(name, protocol, catalog);
  for (const config::Problem& problem : loaded.problems) {
    if (problem.warning) continue;
    const bool in_file = problem.mark.line > 0;
    problems.Error(kCommandLine, (in_file ? problem.mark.ToString() + ": " : "") + problem.message);
  }
  return std::move(loaded.profile);
}

void SetOption(const std::string& setting, const protocols::Protocol& protocol,
               config::Options& options, Problems& problems) {
  const auto equals = setting.find('=');
  if (equals == std::string::npos) return problems.Error(kCommandLine, "--set: write key=value");
  const std::string key = setting.substr(0, equals);
  std::vector<std::string_view> names;
  for (const protocols::OptionSpec& spec : protocol.options) {
    if (spec.scope != protocols::OptionSpec::Scope::device) continue;
    names.push_back(spec.name);
    if (spec.name != key) continue;
    auto value = config::ParseOption(spec, setting.substr(equals + 1));
    if (!value) return problems.Error(kCommandLine, "--set: " + key + ": " + value.error());
    config::Options given;
    given.Set(key, std::move(*value));
    return config::Override(options, given);
  }
  problems.Error(kCommandLine, "--set: unknown key " + problems.ShownKey(key) + ";" +
                                   DidYouMean(key, names) +
                                   " allowed: " + (names.empty() ? "none" : Join(names)));
}

Device MakeDevice(const WantedDevice& wanted, const protocols::Protocol& protocol,
                  const config::Catalog& catalog, config::LineAddresses& addresses,
                  Problems& problems) {
  const config::Profile profile = ReadProfile(wanted.profile, protocol, catalog, problems);
  Device device = config::DeviceFromProfile(profile, protocol, wanted.name, wanted.address);
  device.mark = kCommandLine;
  for (const std::string& setting : wanted.set) {
    SetOption(setting, protocol, device.options, problems);
  }
  const auto none = protocol.canonical_address("");
  if (device.address.empty() && !none) {
    problems.Error(kCommandLine,
                   "--address is missing: a " + std::string(protocol.name) + " device needs it");
    return device;
  }
  if (device.address.empty()) device.address = *none;
  addresses.Add(device, protocol, kCommandLine, problems);
  CheckDevice(device, &protocol, {kCommandLine, {}}, problems);
  return device;
}

config::SerialSettings MakeSerial(const std::string& text, const protocols::Protocol& protocol,
                                  Problems& problems) {
  if (text.empty()) return protocol.serial;
  const auto serial = config::ParseSerial(text, protocol.serial);
  if (!serial) {
    problems.Error(kCommandLine, "serial: " + serial.error());
    return protocol.serial;
  }
  CheckDataBits(*serial, protocol, kCommandLine, problems);
  return *serial;
}

}  // namespace

Result<std::string> ProtocolOfProfile(const std::string& profile, const config::Catalog& catalog) {
  std::string found;
  for (const config::ProfileFile& file : catalog.Profiles()) {
    if (file.name == profile) found = file.protocol;
  }
  if (!found.empty()) return found;
  if (config::IsProfilePath(profile)) return Error{"a profile given by its path needs --protocol"};
  return Error{"no profile named '" + profile + "'; `baudgate profiles` lists them"};
}

Result<Line> MakeLine(const WantedLine& wanted, const config::Catalog& catalog) {
  const std::string profile = wanted.devices.empty() ? "" : wanted.devices.front().profile;
  const auto name = wanted.protocol.empty() ? ProtocolOfProfile(profile, catalog)
                                            : Result<std::string>(wanted.protocol);
  if (!name) return Error{name.error()};
  const auto protocol = catalog.NeedProtocol(*name);
  if (!protocol) return Error{"protocol: " + protocol.error()};
  Problems problems;
  AddSecrets(catalog, problems);
  Line line;
  line.name = wanted.name;
  line.port = wanted.port;
  line.protocol = *name;
  line.tcp = (*protocol)->tcp;
  line.serial = MakeSerial(wanted.serial, **protocol, problems);
  line.options = config::DefaultOptions(**protocol);
  config::LineAddresses addresses;
  for (const WantedDevice& device : wanted.devices) {
    line.devices.push_back(MakeDevice(device, **protocol, catalog, addresses, problems));
  }
  if (!problems.has_error()) return line;
  std::string message;
  for (const config::Problem& problem : problems.Sorted()) {
    if (!problem.warning) message += (message.empty() ? "" : "\n") + problem.message;
  }
  return Error{message};
}

}  // namespace baudgate::tools
