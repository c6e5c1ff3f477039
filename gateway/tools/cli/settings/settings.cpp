// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/settings/settings.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <thread>
#include <utility>

#include "config/model/problem.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/text.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/terminal/command_end.h"
#include "gateway/tools/terminal/tables.h"

namespace baudgate::settings {
namespace {

using Json = tools::ControlClient::Json;

/// Exit code if settings differ or are unknown, or if the file is bad or does not fit the device.
constexpr int kDiffers = 3;

/// How long to wait for an answer. This is longer than the deadline of any write, so that the
/// gateway's result arrives first.
constexpr Duration kWaitForAnswer = 60s;

/// Reads the settings from the file and from the device, and checks that the file fits the device.
/// Returns the exit code; 0: it fits.
int ReadBoth(const tools::SettingsOptions& options, Sheet& file, Sheet& now, std::ostream& err) {
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

}  // namespace

WriteReport SocketWriter::Write(const std::string& point, const std::string& value) {
  auto client = tools::ControlClient::Connect(path_);
  if (!client) return {"not_sent", client.error()};
  client->Send({{"command", "write"}, {"target", point}, {"value", value}, {"confirm", true}});
  std::string line;
  if (client->ReadLine(line, ReadClocks().instant + kWaitForAnswer) !=
      tools::ControlClient::Got::line) {
    return {"unknown", "the gateway at " + client->path() +
                           " did not answer; check with: systemctl status baudgate"};
  }
  const Json answer = Json::parse(line, nullptr, false);
  if (!answer.is_object())
    return {"unknown", "the program that answers at " + client->path() +
                           " is no gateway; name the socket of the gateway with --socket PATH"};
  if (answer.contains("error")) return {"denied", tools::TextOf(answer, "message")};
  WriteReport report{tools::TextOf(answer, "end"), tools::TextOf(answer, "reason")};
  report.read_back = answer.value("read_back", false);
  if (report.end.empty())
    return {"unknown",
            "the gateway has another version than this program; restart or update the gateway"};
  return report;
}

std::optional<std::string> SocketWriter::WhyNot(const std::string& point,
                                                const std::string& value) {
  auto client = tools::ControlClient::Connect(path_);
  if (!client) return client.error();
  client->Send({{"command", "may_write"}, {"target", point}, {"value", value}});
  std::string line;
  if (client->ReadLine(line, ReadClocks().instant + kWaitForAnswer) !=
      tools::ControlClient::Got::line) {
    return "the gateway at " + client->path() +
           " did not answer; check with: systemctl status baudgate";
  }
  const Json answer = Json::parse(line, nullptr, false);
  if (!answer.is_object())
    return "the program that answers at " + client->path() +
           " is no gateway; name the socket of the gateway with --socket PATH";
  if (answer.value("may_write", false)) return std::nullopt;
  return tools::TextOf(answer, answer.contains("error") ? "message" : "reason");
}

std::string Count(std::size_t count) {
  return std::to_string(count) + (count == 1 ? " setting" : " settings");
}

void PrintTable(const std::vector<Difference>& differences, const std::set<std::string>& denied,
                std::ostream& out) {
  tools::TextTable table({"setting", "item", "device", "file", "unit", "note"});
  for (const auto& [filed, now] : differences) {
    const char* note = !now->writable ? "read-only" : denied.contains(filed->point) ? "denied" : "";
    table.Add({filed->point, filed->item, *now->value, *filed->value, filed->unit, note});
  }
  table.PrintAligned(out);
}

}  // namespace baudgate::settings

namespace baudgate::tools {
namespace {

using namespace settings;  // NOLINT

Status WriteNew(const std::string& path, const std::string& text) {
  const auto failed = [&](const char* what) {
    return Error{path + ": " + what + " (" + std::strerror(errno) + ")"};
  };
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (file < 0 && errno == EEXIST) {
    return Error{path + ": the file exists already; choose another name, or remove the file"};
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
        << " of " << sheet.settings.size() << " got no value; the file shows the reasons\n";
  }
  if (sheet.designation.empty()) {
    err << "baudgate: " << options.target
        << " has not sent its designation, so the file cannot be compared or restored; dump the "
           "settings again\n";
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
      << " from " << options.file << " of " << file.time << "; the device was read at most "
      << FormatDuration(std::chrono::ceil<std::chrono::seconds>(now.oldest().value_or(Duration())))
      << " ago\n";
  return comparison.same() ? 0 : kDiffers;
}

namespace {

using namespace settings;  // NOLINT

constexpr Duration kLookAgain = 200ms;

using Plan = std::vector<Difference>;
/// Key: a point that the gateway does not allow to be written; value: the reason.
using Denials = std::map<std::string, std::string>;

/// Returns the settings to write: those that differ and are writable. Fails if such a setting is a
/// number in the device and the file contains no number for it.
Result<Plan> PlanOf(const Comparison& comparison) {
  Plan plan;
  for (const Difference& one : comparison.different) {
    if (!one.now->writable) continue;
    if (ParseDecimal(*one.now->value) && !ParseDecimal(*one.filed->value)) {
      return Error{config::ToString(
          {one.filed->mark, "value: '" + *one.filed->value +
                                "' is no number, but this setting is a number; correct the file"})};
    }
    plan.push_back(one);
  }
  return plan;
}

Denials DenialsOf(const Plan& plan, const Sheet& now, PointWriter& writer) {
  Denials denials;
  for (const auto& [filed, here] : plan) {
    if (auto why = writer.WhyNot(now.target() + "." + filed->point, *filed->value)) {
      denials.emplace(filed->point, std::move(*why));
    }
  }
  return denials;
}

/// Returns the names of a setting in the gateway and in the device. Example: "main_current (S21)".
std::string NameOf(const Difference& row) {
  return row.filed->point + " (" + row.filed->item + ")";
}

class Restore {
 public:
  Restore(const SettingsOptions& options, const Sheet& now, std::ostream& out, std::ostream& err)
      : options_(options), now_(now), out_(out), err_(err) {}

  /// Writes the settings in order. Stops at a signal and at the first write that is not confirmed.
  void WriteAll(const Plan& plan, PointWriter& writer) {
    const StopSignals signals;
    auto row = plan.begin();
    for (; row != plan.end() && !stopped_; ++row) {
      hurried_ = signals.Came();
      if (hurried_) break;
      stopped_ = !Write(*row, writer);
    }
    stopped_ = stopped_ || row != plan.end();
    ReadBack(signals);
    for (; row != plan.end(); ++row) Tell(err_, *row, "not written");
  }
  std::size_t done() const { return written_.size(); }
  bool good() const { return good_ && !stopped_; }

 private:
  struct Written {
    Difference row;
    bool read_back = false;
  };

  void Tell(std::ostream& where, const Difference& row, const std::string& word) const {
    const Setting& filed = *row.filed;
    where << (&where == &err_ ? "baudgate: " : "") << NameOf(row) << ": " << *row.now->value
          << " -> " << *filed.value << (filed.unit.empty() ? "" : " " + filed.unit) << ": " << word
          << std::endl;
  }

  bool Write(const Difference& row, PointWriter& writer) {
    const WriteReport report =
        writer.Write(now_.target() + "." + row.filed->point, *row.filed->value);
    if (!report.done()) {
      Tell(err_, row, report.end + (report.reason.empty() ? "" : ": " + report.reason));
      return false;
    }
    written_.push_back({row, report.read_back});
    if (report.read_back) Tell(out_, row, "written and read back");
    return true;
  }

  /// Waits, at most `patience`, until the gateway has read the written settings back. Reports each
  /// setting whose value is not the written one.
  void ReadBack(const StopSignals& signals) {
    if (written_.empty()) return;
    const Instant until = ReadClocks().instant + options_.patience;
    Sheet shown;
    for (;;) {
      if (AskSheet(options_.socket, options_.target, shown, err_) != 0) shown = {};
      const bool waits = std::ranges::any_of(written_, [&](const Written& one) {
        return !one.read_back && Shown(shown, one.row) == nullptr;
      });
      hurried_ = hurried_ || signals.Came();
      if (!waits || hurried_ || shown.settings.empty() || ReadClocks().instant >= until) break;
      std::this_thread::sleep_for(kLookAgain);
    }
    for (const Written& one : written_) TellShown(one, Shown(shown, one.row));
  }

  static const Setting* Shown(const Sheet& shown, const Difference& row) {
    const Setting* const here = shown.Find(row.filed->point);
    return here != nullptr && here->known ? here : nullptr;
  }

  void TellShown(const Written& one, const Setting* here) {
    const Difference& row = one.row;
    const bool same =
        here != nullptr && IsSameValue(*here->value, *row.filed->value, here->resolution);
    if (same || (one.read_back && here == nullptr)) {
      if (!one.read_back) Tell(out_, row, "written and read back");
      return;
    }
    good_ = false;
    if (one.read_back) {
      err_ << "baudgate: " << NameOf(row) << " has changed since the write: the relay shows "
           << *here->value << '\n';
    } else {
      Tell(err_, row,
           here != nullptr ? "written, but the relay shows " + *here->value
                           : "written, but not read back in time; compare the settings again");
    }
  }

  const SettingsOptions& options_;
  const Sheet& now_;
  std::ostream& out_;
  std::ostream& err_;
  std::vector<Written> written_;
  bool stopped_ = false;
  bool hurried_ = false;  // true: a signal came, so ReadBack does not wait
  bool good_ = true;
};

void PrintPlan(const Comparison& comparison, const Plan& plan, const Denials& denials,
               const Sheet& file, const Sheet& now, std::ostream& out, std::ostream& err) {
  std::set<std::string> denied;
  for (const auto& [point, why] : denials) denied.insert(point);
  if (!comparison.different.empty()) PrintTable(comparison.different, denied, out);
  if (file.target() != now.target() || file.gateway != now.gateway) {
    out << "The settings in the file are from " << file.target() << " of gateway " << file.gateway
        << ".\n";
  }
  const std::size_t fixed = comparison.different.size() - plan.size();
  if (fixed > 0) {
    out << now.target() << ": " << Count(fixed)
        << " that differ are read-only and are not written\n";
  }
  for (const Difference& row : plan) {
    const auto found = denials.find(row.filed->point);
    if (found == denials.end()) continue;
    err << "baudgate: " << NameOf(row) << " would be denied: " << found->second << '\n';
  }
}

}  // namespace

int RunSettingsRestore(const SettingsOptions& options, PointWriter& writer, std::ostream& out,
                       std::ostream& err) {
  Sheet file;
  Sheet now;
  if (const int code = ReadBoth(options, file, now, err); code != 0) return code;
  const Comparison comparison = Compare(file, now);
  PrintOpen(comparison, err);
  if (comparison.unread > 0) {
    err << "baudgate: nothing was written, because some settings of " << now.target()
        << " have no value now (above); see 'baudgate status " << now.target()
        << "', and repeat the command\n";
    return kDiffers;
  }
  const auto plan = PlanOf(comparison);
  if (!plan) {
    err << plan.error() << '\n';
    return kDiffers;
  }
  const Denials denials = DenialsOf(*plan, now, writer);
  PrintPlan(comparison, *plan, denials, file, now, out, err);
  if (plan->empty()) {
    out << now.target() << ": nothing to write\n";
    return comparison.same() ? 0 : kDiffers;
  }
  if (!denials.empty()) {
    out << now.target() << " (" << now.designation
        << "): nothing is written: " << Count(denials.size()) << " of " << plan->size()
        << " would be denied; allow them with 'write' at the device in the configuration, or "
           "remove their rows from the file\n";
    return kDiffers;
  }
  if (!options.confirm) {
    out << now.target() << " (" << now.designation << "): " << Count(plan->size())
        << " would be written, one after the other. Nothing is written yet: add --confirm\n";
    return kDiffers;
  }
  Restore restore(options, now, out, err);
  restore.WriteAll(*plan, writer);
  out << now.target() << ": " << restore.done() << " of " << Count(plan->size()) << " written\n";
  const bool all = plan->size() == comparison.different.size() && comparison.open.empty();
  return restore.good() && all ? 0 : kDiffers;
}

}  // namespace baudgate::tools
