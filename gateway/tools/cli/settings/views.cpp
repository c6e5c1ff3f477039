// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/settings/views.h"

#include <utility>

#include "gateway/tools/terminal/text_table.h"

namespace baudgate::settings {

std::string Count(std::size_t count) {
  return std::to_string(count) + (count == 1 ? " setting" : " settings");
}

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

void PrintTable(const std::vector<Difference>& differences, const std::set<std::string>& denied,
                std::ostream& out) {
  config::TextTable table({"setting", "item", "device", "file", "unit", "note"});
  for (const auto& [filed, now] : differences) {
    const char* note = !now->writable ? "read-only" : denied.contains(filed->point) ? "denied" : "";
    table.Add({filed->point, filed->item, *now->value, *filed->value, filed->unit, note});
  }
  table.PrintAligned(out);
}

}  // namespace baudgate::settings
