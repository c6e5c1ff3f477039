// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/client/kept_configs.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <vector>

#include "gateway/cli/client/control_client.h"
#include "gateway/cli/terminal/text_table.h"
#include "gateway/reload/kept_configs.h"
#include "gateway/reload/text_difference.h"
#include "gateway/state/state_folder.h"
#include "gateway/state/whole_file.h"

namespace baudgate {
namespace {

using Json = ControlClient::Json;
namespace fs = std::filesystem;

constexpr int kUnknown = 2;
constexpr int kCanNot = 4;
constexpr const char* kInstalled = "/etc/baudgate/baudgate.yaml";

struct Places {
  std::string folder;
  std::string file;
};

/// Every gateway.name has a folder of its own.
std::vector<std::string> FoldersOnDisk() {
  std::vector<std::string> folders;
  const fs::path one = StateFolderOf(StatePlaces::Here(""), "x").parent_path();
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(one, error)) {
    const fs::path folder = entry.path() / reload::KeptConfigs::kFolder;
    if (fs::exists(folder / "index.json", error)) folders.push_back(folder.string());
  }
  return folders;
}

Places Find(const KeptConfigsCommand& options) {
  Places places{options.folder, options.file};
  if (places.folder.empty()) {
    std::ostringstream quiet;  // a gateway that does not run is no error here
    Json status;
    if (Ask(options.socket, {{"command", "status"}}, status, quiet) == 0 &&
        status.value("configuration", Json()).is_object()) {
      places.folder = status["configuration"].value("folder", "");
      if (places.file.empty()) places.file = status["configuration"].value("file", "");
    }
  }
  if (places.folder.empty()) {
    const auto folders = FoldersOnDisk();
    if (folders.size() == 1) places.folder = folders.front();
  }
  if (places.file.empty()) places.file = kInstalled;
  return places;
}

bool IsThere(const Places& places, std::ostream& err) {
  std::error_code error;
  if (!places.folder.empty() && fs::exists(fs::path(places.folder) / "index.json", error)) {
    return true;
  }
  err << "baudgate: no applied configurations can be read"
      << (places.folder.empty() ? "" : " in " + places.folder)
      << "; give their folder with --folder STATE/configurations, as somebody who may read it\n";
  return false;
}

/// The number that is meant, or 0 and why not on `err`.
std::uint64_t NumberOf(const KeptConfigsCommand& options, const reload::KeptConfigs& kept,
                       std::ostream& err) {
  const std::uint64_t number = options.number == 0 ? kept.confirmed() : options.number;
  for (const reload::KeptEntry& entry : kept.entries()) {
    if (entry.number == number) return number;
  }
  err << "baudgate: there is no configuration " << number << " in " << kept.folder().string()
      << "; see 'baudgate config history'\n";
  return 0;
}

std::string StateOf(const reload::KeptConfigs& kept, std::uint64_t number) {
  if (number == kept.trial()) return "on trial";
  if (number == kept.refused()) return "taken back: " + kept.why_refused();
  return number == kept.confirmed() ? "confirmed" : "";
}

bool ReadFile(const std::string& file, std::string& text, std::ostream& err) {
  if (auto whole = ReadWhole(file)) {
    text = *std::move(whole);
    return true;
  }
  err << "baudgate: " << file << ": can not be read: " << std::strerror(errno) << "\n";
  return false;
}

/// As owner, group and mode were. The error is errno's.
int Replace(const std::string& file, const std::string& text) {
  struct stat was {};
  const bool known = ::stat(file.c_str(), &was) == 0;
  if (const int error = WriteWhole(file, text); error != 0) return error;
  if (!known) return 0;
  if (::chown(file.c_str(), was.st_uid, was.st_gid) != 0) return errno;
  return ::chmod(file.c_str(), was.st_mode & 07777) == 0 ? 0 : errno;
}

}  // namespace

int RunConfigHistory(const KeptConfigsCommand& options, std::ostream& out, std::ostream& err) {
  const Places places = Find(options);
  if (!IsThere(places, err)) return kCanNot;
  const reload::KeptConfigs kept(places.folder);
  config::TextTable table({"NUMBER", "APPLIED", "BY", "STATE"});
  for (const reload::KeptEntry& entry : kept.entries()) {
    if (options.json) {
      out << Json({{"number", entry.number},
                   {"time", FormatWallTime(entry.time)},
                   {"by", entry.by},
                   {"state", StateOf(kept, entry.number)}})
                 .dump()
          << '\n';
    }
    table.Add({std::to_string(entry.number), FormatWallTime(entry.time), entry.by,
               StateOf(kept, entry.number)});
  }
  if (!options.json) table.PrintAligned(out);
  return 0;
}

int RunConfigDiff(const KeptConfigsCommand& options, std::ostream& out, std::ostream& err) {
  const Places places = Find(options);
  if (!IsThere(places, err)) return kCanNot;
  const reload::KeptConfigs kept(places.folder);
  const std::uint64_t number = NumberOf(options, kept, err);
  if (number == 0) return kUnknown;
  std::string text;
  if (!ReadFile(places.file, text, err)) return kCanNot;
  const auto before = kept.TextOf(number);
  if (!before) {
    err << "baudgate: " << before.error() << '\n';
    return kCanNot;
  }
  const auto lines = reload::TextDifference(*before, text);
  if (lines.empty()) {
    out << places.file << " is configuration " << number << '\n';
    return 0;
  }
  out << "- configuration " << number << "\n+ " << places.file << '\n';
  for (const std::string& line : lines) out << line << '\n';
  return 0;
}

int RunConfigRestore(const KeptConfigsCommand& options, std::ostream& out, std::ostream& err) {
  const Places places = Find(options);
  if (!IsThere(places, err)) return kCanNot;
  const reload::KeptConfigs kept(places.folder);
  const std::uint64_t number = NumberOf(options, kept, err);
  if (number == 0) return kUnknown;
  const auto text = kept.TextOf(number);
  if (!text) {
    err << "baudgate: " << text.error() << '\n';
    return kCanNot;
  }
  std::error_code error;
  fs::copy_file(places.file, places.file + ".old", fs::copy_options::overwrite_existing, error);
  const bool kept_old = !error || !fs::exists(places.file);
  const int failed = kept_old ? Replace(places.file, *text) : error.value();
  if (failed != 0) {
    err << "baudgate: " << places.file << " is not restored: " << std::strerror(failed)
        << (failed == EACCES ? "; do it as root: sudo baudgate config restore" : "") << '\n';
    return kCanNot;
  }
  out << places.file << " is configuration " << number << " again; what it was is " << places.file
      << ".old. 'baudgate reload' applies it\n";
  return 0;
}

}  // namespace baudgate
