// What the commands of `baudgate settings` share: both sides read, and differences shown.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <set>
#include <string>
#include <vector>

#include "gateway/tools/cli/settings/comparison.h"
#include "gateway/tools/cli/settings/settings.h"
#include "gateway/tools/cli/settings/sheet.h"

namespace baudgate::settings {

/// The exit code where both sides are known, and it is not as it should be.
inline constexpr int kDiffers = 3;

/// "1 setting", "2 settings".
std::string Count(std::size_t count);

/// Reads the file and asks for the device; both have to fit. The exit code, or 0.
int ReadBoth(const SettingsOptions& options, Sheet& file, Sheet& now, std::ostream& err);

void PrintOpen(const Comparison& comparison, std::ostream& err);

/// `denied`: points that may not be written, though they can.
void PrintTable(const std::vector<Difference>& differences, const std::set<std::string>& denied,
                std::ostream& out);

}  // namespace baudgate::settings
