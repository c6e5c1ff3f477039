// Subcommands that act on a running gateway. RunRelease lends a line's port for a limited time,
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
  std::string socket{};    ///< path of the control socket; empty: the only running gateway is used
  Duration patience = 5s;  ///< how long to wait for the port to be closed, or the loan to end
  /// Offers the port over the network at this ADDRESS:PORT; empty: offers it to a program on this
  /// machine.
  std::string tcp{};
  bool rfc2217 = false;
  /// Networks whose clients are allowed to connect to `tcp`, separated by blanks; empty: all
  /// networks.
  std::string allow{};
};

/// Returns when the gateway has closed the port, with `tcp` when clients can connect, with `end`
/// when the loan has ended, so that a script can go on. Exit codes: 0 done; 2 unknown line or a
/// time out of range; 4 no gateway answers, or the port does not close or admits no client.
int RunRelease(const ReleaseOptions& options, std::ostream& out, std::ostream& err);

struct ReloadCommand {
  bool dry_run = false;
  /// The user must confirm the new configuration within this time, else the gateway goes back to
  /// the confirmed configuration; empty: no confirmation is needed.
  std::optional<Duration> confirm{};
  bool json = false;
  std::string socket;  ///< path of the control socket; empty: the only running gateway is used
};

/// Exit codes: 0 the configuration is applied, or with `dry_run` it could be applied; 2 the file
/// has errors or needs a restart; 4 a port cannot be opened, no gateway answers, or a disk fails.
/// After 2 and 4 nothing was applied.
int RunReload(const ReloadCommand& options, std::ostream& out, std::ostream& err);

struct ConfirmCommand {
  std::string socket;
};

/// Exit codes: 0 confirmed; 2 no configuration waits for confirmation; 4 as for RunReload.
int RunConfirm(const ConfirmCommand& options, std::ostream& out, std::ostream& err);
int RunRevert(const ConfirmCommand& options, std::ostream& out, std::ostream& err);

struct ReadOptions {
  std::string target;  ///< "LINE.DEVICE" or "LINE.DEVICE.POINT"
  bool json = false;
  std::string socket;  ///< path of the control socket; empty: the only running gateway is used
  /// True: the gateway is temporary and ends after this answer, so no advice about the gateway is
  /// printed. The caller prints why points were not read.
  bool passing = false;
  /// True: the device sends unasked, so every value that came since the gateway's start counts as
  /// read.
  bool unasked = false;
};

struct WriteOptions {
  std::string target;  ///< "LINE.DEVICE.POINT"
  std::string value;   ///< the value in the point's unit
  bool confirm = false;
  bool json = false;
  std::string socket;
  /// "NAME/NUMBER", chosen by the user: a repeated request is answered but not written again;
  /// empty: each request is new.
  std::string request{};
};

/// The exit code when the device did not answer, refused the request, or is not allowed to be
/// written.
inline constexpr int kNotDone = 1;

/// Exit codes: 0 all points were read now; kNotDone: some points were not read; 2 unknown target; 4
/// no gateway answers.
int RunRead(const ReadOptions& options, std::ostream& out, std::ostream& err);

/// Exit codes: 0 the device has confirmed the write; kNotDone: the device has not confirmed it; 2
/// unknown target, or a value that the point cannot have; 4 no gateway answers.
int RunWrite(const WriteOptions& options, std::ostream& out, std::ostream& err);

// `baudgate enable` and `baudgate disable`: start or stop polling a device, until the gateway
// restarts.
struct InUseOptions {
  std::string target;  ///< "LINE.DEVICE"
  bool in_use = true;
  std::string socket;
};

/// Exit codes: 0 done; 2 unknown device; 4 no gateway answers.
int RunInUse(const InUseOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
