// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/settings/settings.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "gateway/base/exit_code.h"
#include "gateway/base/text.h"
#include "gateway/tools/cli/settings/comparison.h"
#include "gateway/tools/cli/settings/sheet.h"
#include "gateway/tools/cli/settings/views.h"

namespace baudgate {
namespace {

using namespace settings;  // NOLINT

/// A new file: what a person has kept is never written over.
Status WriteNew(const std::string& path, const std::string& text) {
  const auto failed = [&](const char* what) {
    return Error{path + ": " + what + " (" + std::strerror(errno) + ")"};
  };
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (file < 0 && errno == EEXIST) {
    return Error{path + ": is there already; choose another name, or remove it"};
  }
  if (file < 0) return failed("cannot be made");
  std::size_t written = 0;
  while (written < text.size()) {
    const auto count = ::write(file, text.data() + written, text.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      Status why = failed("cannot be written");
      ::close(file);
      return why;
    }
    written += static_cast<std::size_t>(count);
  }
  if (::close(file) != 0) return failed("cannot be written");
  return {};
}

void PrintJson(const Sheet& now, const Comparison& comparison, std::ostream& out) {
  ControlClient::Json json = {{"device", now.target()}, {"same", comparison.same()}};
  auto& different = json["different"] = ControlClient::Json::array();
  for (const auto& [filed, here] : comparison.different) {
    different.push_back({{"point", filed->point},
                         {"item", filed->item},
                         {"device", *here->value},
                         {"file", *filed->value},
                         {"unit", filed->unit},
                         {"writable", here->writable}});
  }
  json["open"] = comparison.open;
  json["oldest_ms"] = now.oldest().value_or(Duration()) / 1ms;
  out << json.dump(2, ' ', false, ControlClient::Json::error_handler_t::replace) << '\n';
}

}  // namespace

int RunSettingsDump(const SettingsOptions& options, std::ostream& out, std::ostream& err) {
  Sheet sheet;
  if (const int code = AskSheet(options.socket, options.target, sheet, err); code != 0) return code;
  const std::string text = options.json ? ToJson(sheet) : ToYaml(sheet);
  if (options.file.empty()) {
    out << text;
  } else if (const Status written = WriteNew(options.file, text); !written) {
    err << "baudgate: " << written.error() << '\n';
    return kExitCanNot;
  }
  const auto unknown =
      std::ranges::count_if(sheet.settings, [](const Setting& setting) { return !setting.known; });
  if (unknown == 0 && !sheet.designation.empty()) return 0;
  if (unknown > 0) {
    err << "baudgate: " << options.target << ": " << Count(static_cast<std::size_t>(unknown))
        << " of " << sheet.settings.size() << " not known at present; the file says why\n";
  }
  if (sheet.designation.empty()) {
    err << "baudgate: " << options.target
        << " has not said what it is: the file cannot be compared nor restored\n";
  }
  return kDiffers;
}

int RunSettingsCompare(const SettingsOptions& options, std::ostream& out, std::ostream& err) {
  Sheet file;
  Sheet now;
  if (const int code = ReadBoth(options, file, now, err); code != 0) return code;
  const Comparison comparison = Compare(file, now);
  if (options.json) {
    PrintJson(now, comparison, out);
    return comparison.same() ? 0 : kDiffers;
  }
  PrintOpen(comparison, err);
  if (!comparison.different.empty()) PrintTable(comparison.different, {}, out);
  out << now.target() << " (" << now.designation << "): "
      << (comparison.different.empty() ? "no setting differs"
                                       : Count(comparison.different.size()) + " of " +
                                             std::to_string(file.settings.size()) + " differ")
      << " from " << options.file << " of " << file.time << ", as read "
      << FormatDuration(std::chrono::ceil<std::chrono::seconds>(now.oldest().value_or(Duration())))
      << " ago or later\n";
  return comparison.same() ? 0 : kDiffers;
}

}  // namespace baudgate
