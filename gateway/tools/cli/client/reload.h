// `baudgate reload` and `baudgate confirm`: another configuration for the gateway that runs.
// docs/reload.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>

#include "gateway/base/time.h"

namespace baudgate {

struct ReloadCommand {
  bool dry_run = false;
  std::optional<Duration> confirm{};  ///< empty: it needs no confirmation
  bool json = false;
  std::string socket;  ///< empty: the gateway in the default places
};

/// Exit codes: 0 applied, or could be; 2 the file is bad or needs a restart, and nothing is
/// applied; 4 likewise, as a port cannot be opened, or no gateway answers, or a disk fails.
int RunReload(const ReloadCommand& options, std::ostream& out, std::ostream& err);

struct ConfirmCommand {
  std::string socket;
};

/// Exit codes: 0; 2 nothing waits to be confirmed; 4 as above.
int RunConfirm(const ConfirmCommand& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate
