// `baudgate config history`, `diff` and `restore`: the configurations that the gateway has applied.
// They lie in its state folder, and are read there, also while it does not run. docs/reload.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ostream>
#include <string>

namespace baudgate {

struct KeptConfigsCommand {
  std::uint64_t number = 0;  ///< 0: the one that is confirmed
  std::string file;          ///< empty: that of the gateway, or the installed one
  std::string folder;        ///< empty: that of the gateway, or the only one there is
  std::string socket;
  bool json = false;
};

/// Exit codes of all: 0; 2 there is no such number; 4 the folder or a file can not be read, or
/// written.
int RunConfigHistory(const KeptConfigsCommand& options, std::ostream& out, std::ostream& err);
/// The file against it: what "restore" would take back.
int RunConfigDiff(const KeptConfigsCommand& options, std::ostream& out, std::ostream& err);
/// Writes it over the file, which is kept as FILE.old; a reload applies it.
int RunConfigRestore(const KeptConfigsCommand& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate
