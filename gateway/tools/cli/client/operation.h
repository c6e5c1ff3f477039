// `baudgate release`: lends a line's port to another program or, over the network, to a client for
// a while, and takes it back. RunReload and RunConfirm are `baudgate reload` and `baudgate
// confirm`; RunRead and RunWrite ask for points and write them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <string>

#include "gateway/base/time.h"

namespace baudgate::tools {

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

// `baudgate read` and `baudgate write`: points of a running gateway's devices, asked now. RunInUse
// is `baudgate enable` and `baudgate disable`.

struct ReadOptions {
  std::string target;  ///< "LINE.DEVICE" or "LINE.DEVICE.POINT"
  bool json = false;
  std::string socket;    ///< empty: the gateway in the default places
  bool passing = false;  ///< the gateway ends with this answer: whoever asked says what is wrong
  bool unasked = false;  ///< the device speaks by itself, and has since the gateway began
};

struct WriteOptions {
  std::string target;  ///< "LINE.DEVICE.POINT"
  std::string value;   ///< in the point's unit
  bool confirm = false;
  bool json = false;
  std::string socket;
  std::string request{};  ///< "NAME/NUMBER"; empty: it has none
};

/// Asked, but not done: the device did not answer, or refused, or may not be written.
inline constexpr int kNotDone = 1;

/// Exit code 0: all was read now; kNotDone; 2 for an unknown target; 4 when no gateway answers.
int RunRead(const ReadOptions& options, std::ostream& out, std::ostream& err);

/// Exit code 0: the device has confirmed it; kNotDone; 2 for an unknown target or a value that is
/// none of the point; 4 when no gateway answers.
int RunWrite(const WriteOptions& options, std::ostream& out, std::ostream& err);

// `baudgate enable` and `baudgate disable`: whether a device is asked, until the gateway restarts.
struct InUseOptions {
  std::string target;  ///< "LINE.DEVICE"
  bool in_use = true;
  std::string socket;  ///< empty: the gateway in the default places
};

/// Exit code 0; 2 for an unknown device; 4 when no gateway answers.
int RunInUse(const InUseOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
