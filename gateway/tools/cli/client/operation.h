// Commands that act on a running gateway. RunRelease lends a line's port for a limited time,
// RunReload and RunConfirm change the configuration, RunRead and RunWrite access points, and
// RunInUse enables or disables a device.
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
  bool end = false;
  std::string socket{};    ///< empty: the gateway in the default places
  Duration patience = 5s;  ///< how long to wait until the port is closed or open
  /// Offer the port over the network at this ADDRESS:PORT; empty: to a program on this machine.
  std::string tcp{};
  bool rfc2217 = false;
  /// Networks whose clients may connect to `tcp`, separated by blanks; empty: all.
  std::string allow{};
};

/// Releases the port and returns when it is closed (or open again with `end`), so that a script can
/// go on. Exit codes: 0; 2 unknown line or a time out of range; 4 no gateway answers, or the port
/// does not close.
int RunRelease(const ReleaseOptions& options, std::ostream& out, std::ostream& err);

// `baudgate reload` and `baudgate confirm` change the configuration; see docs/reload.md.
struct ReloadCommand {
  bool dry_run = false;
  /// The time to confirm within, before the gateway rolls back; empty: no confirmation needed.
  std::optional<Duration> confirm{};
  bool json = false;
  std::string socket;  ///< empty: the gateway in the default places
};

/// Exit codes: 0 the configuration is applied, or (dry run) could be; 2 the file has errors or
/// needs a restart; 4 a port cannot be opened, no gateway answers, or a disk fails. After 2 and 4
/// nothing has been applied.
int RunReload(const ReloadCommand& options, std::ostream& out, std::ostream& err);

struct ConfirmCommand {
  std::string socket;
};

/// Exit codes: 0 confirmed; 2 no configuration waits for confirmation; 4 as for RunReload.
int RunConfirm(const ConfirmCommand& options, std::ostream& out, std::ostream& err);

// `baudgate read` and `baudgate write`: read or write points of a running gateway's devices now.

struct ReadOptions {
  std::string target;  ///< "LINE.DEVICE" or "LINE.DEVICE.POINT"
  bool json = false;
  std::string socket;  ///< empty: the gateway in the default places
  /// The gateway ends after this answer: the caller prints the reason of a failure.
  bool passing = false;
  bool unasked = false;  ///< the device sends unasked and has done so since the gateway started
};

struct WriteOptions {
  std::string target;  ///< "LINE.DEVICE.POINT"
  std::string value;   ///< in the point's unit
  bool confirm = false;
  bool json = false;
  std::string socket;
  std::string request{};  ///< "NAME/NUMBER" of the request; empty: none
};

/// The exit code when the device did not answer, refused the request, or may not be written.
inline constexpr int kNotDone = 1;

/// Exit codes: 0 all points were read now; kNotDone; 2 unknown target; 4 no gateway answers.
int RunRead(const ReadOptions& options, std::ostream& out, std::ostream& err);

/// Exit codes: 0 the device has confirmed the write; kNotDone; 2 unknown target, or a value that
/// the point cannot have; 4 no gateway answers.
int RunWrite(const WriteOptions& options, std::ostream& out, std::ostream& err);

// `baudgate enable` and `baudgate disable`: polls a device or not, until the gateway restarts.
struct InUseOptions {
  std::string target;  ///< "LINE.DEVICE"
  bool in_use = true;
  std::string socket;
};

/// Exit codes: 0; 2 unknown device; 4 no gateway answers.
int RunInUse(const InUseOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
