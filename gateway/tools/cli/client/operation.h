// `baudgate release`: lends a line's port to another program or, over the network, to a client for
// a while, and takes it back. RunReload and RunConfirm are `baudgate reload` and `baudgate
// confirm`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>

#include "gateway/base/time.h"

namespace baudgate {

struct ReleaseOptions {
  std::string line;
  Duration time = 10min;
  bool end = false;        ///< take it back instead
  std::string socket{};    ///< empty: the gateway in the default places
  Duration patience = 5s;  ///< for the port to be closed or opened
  std::string tcp{};       ///< lend it over the network, at this ADDRESS:PORT; empty: here
  bool rfc2217 = false;
  std::string allow{};  ///< who may come in there, with blanks between them; empty: everybody
};

/// Returns when the port is closed (or open again), so that a script may go on. Exit code 0; 2 for
/// an unknown line or a time out of range; 4 when no gateway answers or the port does not close.
int RunRelease(const ReleaseOptions& options, std::ostream& out, std::ostream& err);

// `baudgate reload` and `baudgate confirm`: another configuration for the gateway that runs.
// docs/reload.md.
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
