// `baudgate settings dump | compare | restore`: the settings of a relay into a file, the file
// against the relay, and back into it. docs/settings.md has it for users.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>

#include "gateway/base/time.h"
#include "gateway/tools/cli/settings/point_writer.h"

namespace baudgate {

struct SettingsOptions {
  std::string target;  ///< LINE.DEVICE
  std::string file;    ///< of dump: empty is standard output
  bool json = false;
  bool confirm = false;                          ///< of restore: without it nothing is written
  std::string socket;                            ///< empty: the gateway in the default places
  Duration patience = std::chrono::seconds(10);  ///< of restore: with the read-back
};

// Exit codes: 0, and the device has what the file says; 2 wrong usage; 3 the file is bad or another
// device's, settings differ or are not known, or the restore has stopped; 4 no gateway answers, or
// the file cannot be written.
int RunSettingsDump(const SettingsOptions& options, std::ostream& out, std::ostream& err);
int RunSettingsCompare(const SettingsOptions& options, std::ostream& out, std::ostream& err);
int RunSettingsRestore(const SettingsOptions& options, settings::PointWriter& writer,
                       std::ostream& out, std::ostream& err);

}  // namespace baudgate
