// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/check_profile.h"

#include <algorithm>
#include <filesystem>

#include "config/loader.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/whole_file.h"
#include "gateway/tools/cli/offline/check.h"

namespace baudgate {
namespace {

namespace fs = std::filesystem;

struct Judged {
  const Protocol* protocol = nullptr;
  config::LoadedProfile loaded;
};

std::size_t Errors(const std::vector<config::Problem>& problems) {
  return static_cast<std::size_t>(
      std::ranges::count_if(problems, [](const auto& problem) { return !problem.warning; }));
}

/// What the protocol would warn of in every device of this type.
void AddDoubts(Judged& judged) {
  const Protocol& protocol = *judged.protocol;
  if (protocol.doubts == nullptr) return;
  for (const char* address : {"1", "0"}) {
    if (!protocol.canonical_address(address)) continue;
    const auto device = config::DeviceFromProfile(judged.loaded.profile, protocol, "x", address);
    for (const Doubt& doubt : protocol.doubts(device)) {
      if (doubt.point >= device.points.size()) continue;
      const config::Point& point = device.points[doubt.point];
      judged.loaded.problems.push_back(
          {point.mark, "point '" + point.name + "' " + doubt.text, true});
    }
    return;
  }
}

Judged Judge(const std::string& text, const std::string& file, const Protocol& protocol,
             const config::Catalog& catalog) {
  const std::string name = fs::path(file).stem().string();
  return {&protocol, config::LoadProfileText(text, file, name, protocol, catalog)};
}

/// As a profile of the protocol whose folder it lies in; else of the one that finds least fault.
Judged JudgeByContent(const std::string& text, const std::string& file,
                      const config::Catalog& catalog) {
  const std::string folder = fs::absolute(file).parent_path().filename().string();
  if (const Protocol* protocol = catalog.FindProtocol(folder)) {
    return Judge(text, file, *protocol, catalog);
  }
  std::optional<Judged> best;
  for (const auto& [name, protocol] : catalog.protocols) {
    if (!protocol->profiles_of.empty()) continue;
    Judged judged = Judge(text, file, *protocol, catalog);
    if (!best || Errors(judged.loaded.problems) < Errors(best->loaded.problems)) {
      best = std::move(judged);
    }
  }
  return best ? std::move(*best) : Judged{};
}

}  // namespace

int RunCheckProfile(const CheckProfileOptions& options, const config::Catalog& catalog,
                    std::ostream& out, std::ostream& err) {
  const auto text = ReadWhole(options.file);
  if (!text) {
    err << "baudgate: cannot read " << options.file << "\n";
    return kExitCanNot;
  }
  Judged judged;
  if (options.protocol.empty()) {
    judged = JudgeByContent(*text, options.file, catalog);
  } else {
    const auto protocol = catalog.NeedProtocol(options.protocol);
    if (!protocol) {
      err << "baudgate: --protocol: " << protocol.error() << "\n";
      return kExitUsage;
    }
    judged = Judge(*text, options.file, **protocol, catalog);
  }
  if (judged.protocol == nullptr) {
    err << "baudgate: no protocol is installed\n";
    return kExitCanNot;
  }
  if (judged.loaded.ok()) AddDoubts(judged);
  PrintProblems(judged.loaded.problems, err);
  const std::string as = "a profile of " + std::string(judged.protocol->name);
  if (!judged.loaded.ok()) {
    const std::size_t errors = Errors(judged.loaded.problems);
    err << options.file << ": " << errors << (errors == 1 ? " error" : " errors") << ", read as "
        << as << (options.protocol.empty() ? "; --protocol names another" : "") << '\n';
    return kExitBadConfiguration;
  }
  PrintProfile(judged.loaded.profile, options.format, options.width, out);
  return kExitDone;
}

}  // namespace baudgate
