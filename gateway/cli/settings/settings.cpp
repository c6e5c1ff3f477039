// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/settings/settings.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <span>
#include <thread>

#include "config/model/problem.h"
#include "gateway/base/text.h"
#include "gateway/cli/settings/comparison.h"
#include "gateway/cli/settings/sheet.h"
#include "gateway/cli/terminal/text_table.h"

namespace baudgate {
namespace {

using namespace settings;  // NOLINT

constexpr int kDiffers = 3;
constexpr int kCannotOpen = 4;
constexpr Duration kLookAgain = 200ms;

/// A new file: what a person has kept is never written over.
Status WriteNew(const std::string& path, const std::string& text) {
  const auto failed = [&](const char* what) {
    return Error{path + ": " + what + " (" + std::strerror(errno) + ")"};
  };
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (file < 0 && errno == EEXIST) {
    return Error{path + ": is there already; choose another name, or remove it"};
  }
  if (file < 0) return failed("can not be made");
  std::size_t written = 0;
  while (written < text.size()) {
    const auto count = ::write(file, text.data() + written, text.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      Status why = failed("can not be written");
      ::close(file);
      return why;
    }
    written += static_cast<std::size_t>(count);
  }
  if (::close(file) != 0) return failed("can not be written");
  return {};
}

std::string Count(std::size_t count) {
  return std::to_string(count) + (count == 1 ? " setting" : " settings");
}

/// Reads the file and asks for the device; both have to fit. The exit code.
int ReadBoth(const SettingsOptions& options, Sheet& file, Sheet& now, std::ostream& err) {
  auto sheet = ReadSheet(options.file);
  if (!sheet) {
    err << sheet.error() << '\n';
    return kDiffers;
  }
  file = std::move(*sheet);
  if (const int code = AskSheet(options.socket, options.target, now, err); code != 0) return code;
  if (const Status fits = CheckFit(file, now); !fits) {
    err << fits.error() << '\n';
    return kDiffers;
  }
  return 0;
}

void PrintOpen(const Comparison& comparison, std::ostream& err) {
  for (const std::string& open : comparison.open) err << "baudgate: " << open << '\n';
}

void PrintTable(const std::vector<Difference>& differences, std::ostream& out) {
  config::TextTable table({"setting", "item", "device", "file", "unit", ""});
  for (const auto& [filed, now] : differences) {
    table.Add({filed->point, filed->item, *now->value, *filed->value, filed->unit,
               now->writable ? "" : "read-only"});
  }
  table.PrintAligned(out);
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

// ---------------------------------------------------------------- restore

/// What would have to be written; an error where that is no number, though the device's is.
Result<std::vector<Difference>> PlanOf(const Comparison& comparison) {
  std::vector<Difference> plan;
  for (const Difference& one : comparison.different) {
    if (!one.now->writable) continue;
    if (ParseDecimal(*one.now->value) && !ParseDecimal(*one.filed->value)) {
      return Error{
          config::ToString({one.filed->mark, "value: '" + *one.filed->value + "' is no number"})};
    }
    plan.push_back(one);
  }
  return plan;
}

/// How many were confirmed, one after the other, up to the first that was not.
std::size_t WriteAll(const std::vector<Difference>& plan, const Sheet& now, PointWriter& writer,
                     std::ostream& out, std::ostream& err) {
  std::size_t done = 0;
  for (const auto& [filed, here] : plan) {
    const WriteReport report = writer.Write(now.target() + "." + filed->point, *filed->value);
    const std::string what = filed->point + " (" + filed->item + "): " + *here->value + " -> " +
                             *filed->value + (filed->unit.empty() ? "" : " " + filed->unit);
    if (!report.done()) {
      err << "baudgate: " << what << ": " << report.end
          << (report.reason.empty() ? "" : ": " + report.reason) << '\n';
      return done;
    }
    out << what << (report.read_back ? ": written and read back\n" : ": written\n");
    out.flush();
    ++done;
  }
  return done;
}

/// Asks until every one of `written` is known again, or patience ends; names those that are not as
/// they should be. False: there are some.
bool ReadBack(const SettingsOptions& options, std::span<const Difference> written,
              std::ostream& err) {
  const Instant until = ReadClocks().instant + options.patience;
  for (;;) {
    Sheet now;
    if (AskSheet(options.socket, options.target, now, err) != 0) return false;
    const auto is_known = [&](const Difference& one) {
      const Setting* const here = now.Find(one.filed->point);
      return here != nullptr && here->known;
    };
    if (!std::ranges::all_of(written, is_known) && ReadClocks().instant < until) {
      std::this_thread::sleep_for(kLookAgain);
      continue;
    }
    bool good = true;
    for (const Difference& one : written) {
      const Setting* const here = now.Find(one.filed->point);
      if (is_known(one) && IsSameValue(*here->value, *one.filed->value)) continue;
      good = false;
      err << "baudgate: " << one.filed->point << " (" << one.filed->item << ") "
          << (is_known(one)
                  ? "shows " + *here->value + " after " + *one.filed->value + " was written"
                  : "could not be read back")
          << '\n';
    }
    return good;
  }
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
    return kCannotOpen;
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
        << " has not said what it is: the file can not be compared nor restored\n";
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
  if (!comparison.different.empty()) PrintTable(comparison.different, out);
  out << now.target() << " (" << now.designation << "): "
      << (comparison.different.empty() ? "no setting differs"
                                       : Count(comparison.different.size()) + " of " +
                                             std::to_string(file.settings.size()) + " differ")
      << " from " << options.file << " of " << file.time << ", as read "
      << FormatDuration(std::chrono::ceil<std::chrono::seconds>(now.oldest().value_or(Duration())))
      << " ago or later\n";
  return comparison.same() ? 0 : kDiffers;
}

int RunSettingsRestore(const SettingsOptions& options, PointWriter& writer, std::ostream& out,
                       std::ostream& err) {
  Sheet file;
  Sheet now;
  if (const int code = ReadBoth(options, file, now, err); code != 0) return code;
  const Comparison comparison = Compare(file, now);
  PrintOpen(comparison, err);
  if (comparison.unread > 0) {
    err << "baudgate: nothing is written before " << now.target()
        << " has told all its settings; see 'baudgate status " << now.target() << "'\n";
    return kDiffers;
  }
  const auto plan = PlanOf(comparison);
  if (!plan) {
    err << plan.error() << '\n';
    return kDiffers;
  }
  if (!comparison.different.empty()) PrintTable(comparison.different, out);
  if (file.target() != now.target() || file.gateway != now.gateway) {
    out << "The file was read from " << file.target() << " of gateway " << file.gateway << ".\n";
  }
  const std::size_t fixed = comparison.different.size() - plan->size();
  if (fixed > 0) {
    out << now.target() << ": " << Count(fixed) << " that differ can only be read, and stay\n";
  }
  if (plan->empty()) {
    out << now.target() << ": nothing to write\n";
    return comparison.same() ? 0 : kDiffers;
  }
  if (!options.confirm) {
    out << now.target() << " (" << now.designation << "): " << Count(plan->size())
        << " would be written, one after the other. Nothing is written yet: add --confirm\n";
    return kDiffers;
  }
  const std::size_t done = WriteAll(*plan, now, writer, out, err);
  const bool shown = ReadBack(options, std::span(*plan).first(done), err);
  out << now.target() << ": " << done << " of " << Count(plan->size()) << " written"
      << (done < plan->size() ? "; the rest is as it was, but for the one that is named above\n"
                              : "\n");
  const bool all = done == plan->size() && fixed == 0 && comparison.open.empty();
  return shown && all ? 0 : kDiffers;
}

}  // namespace baudgate
