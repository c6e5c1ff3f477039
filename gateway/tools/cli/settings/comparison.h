// What a file of settings says against what the device has now. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/tools/cli/settings/sheet.h"

namespace baudgate::settings {

/// Both sides are known, and say different things.
struct Difference {
  const Setting* filed = nullptr;  ///< in the sheet of the file
  const Setting* now = nullptr;    ///< in that of the device
};

struct Comparison {
  std::vector<Difference> different;  ///< in the order of the file
  /// One sentence each: what could not be compared, because a side does not have or know it.
  std::vector<std::string> open;
  std::size_t unread = 0;  ///< of these, settings of the file that the device has not told of late

  bool same() const { return different.empty() && open.empty(); }
};

/// Whether the file can be that of this device: the same profile, the same designation, the same
/// items in the same units. The error names the place in the file.
Status CheckFit(const Sheet& file, const Sheet& now);

/// Both sheets outlive the comparison.
Comparison Compare(const Sheet& file, const Sheet& now);

/// "0.90" is 0.9; 12345678 is not 12345679. `resolution`: Setting::resolution.
bool IsSameValue(const std::string& a, const std::string& b, std::optional<double> resolution = {});

}  // namespace baudgate::settings
