// `baudgate settings restore`: what would be written, whether it may be, and then row by row, each
// of which ends in one word.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <thread>

#include "config/model/problem.h"
#include "gateway/base/text.h"
#include "gateway/tools/cli/settings/settings.h"
#include "gateway/tools/cli/settings/views.h"
#include "gateway/tools/terminal/stop_signals.h"

namespace baudgate {
namespace {

using namespace settings;  // NOLINT

constexpr Duration kLookAgain = 200ms;

using Plan = std::vector<Difference>;
/// By point: why it may not be written.
using Denials = std::map<std::string, std::string>;

/// What would have to be written; an error where that is no number, though the device's is.
Result<Plan> PlanOf(const Comparison& comparison) {
  Plan plan;
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

Denials DenialsOf(const Plan& plan, const Sheet& now, PointWriter& writer) {
  Denials denials;
  for (const auto& [filed, here] : plan) {
    if (auto why = writer.WhyNot(now.target() + "." + filed->point, *filed->value)) {
      denials.emplace(filed->point, std::move(*why));
    }
  }
  return denials;
}

/// "main_current (S21)".
std::string NameOf(const Difference& row) {
  return row.filed->point + " (" + row.filed->item + ")";
}

/// Writes row by row, and says of each what became of it.
class Restore {
 public:
  Restore(const SettingsOptions& options, const Sheet& now, std::ostream& out, std::ostream& err)
      : options_(options), now_(now), out_(out), err_(err) {}

  /// Up to the first that is not confirmed, or a signal.
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

  /// What has not been read back is waited for; what was may have changed since.
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

  /// Null: it is not known what the device holds.
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
      err_ << "baudgate: " << NameOf(row) << " has changed since: it shows " << *here->value
           << '\n';
    } else {
      Tell(err_, row,
           here != nullptr ? "written, but it shows " + *here->value : "written, not read back");
    }
  }

  const SettingsOptions& options_;
  const Sheet& now_;
  std::ostream& out_;
  std::ostream& err_;
  std::vector<Written> written_;
  bool stopped_ = false;
  bool hurried_ = false;  ///< by a signal: nothing is waited for any more
  bool good_ = true;
};

void PrintPlan(const Comparison& comparison, const Plan& plan, const Denials& denials,
               const Sheet& file, const Sheet& now, std::ostream& out, std::ostream& err) {
  std::set<std::string> denied;
  for (const auto& [point, why] : denials) denied.insert(point);
  if (!comparison.different.empty()) PrintTable(comparison.different, denied, out);
  if (file.target() != now.target() || file.gateway != now.gateway) {
    out << "The file was read from " << file.target() << " of gateway " << file.gateway << ".\n";
  }
  const std::size_t fixed = comparison.different.size() - plan.size();
  if (fixed > 0) {
    out << now.target() << ": " << Count(fixed)
        << " that differ can only be read, and are not written\n";
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
    err << "baudgate: nothing is written before " << now.target()
        << " has told all its settings; see 'baudgate status " << now.target() << "'\n";
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
        << " would be denied; allow them, or remove their rows from the file\n";
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

}  // namespace baudgate
