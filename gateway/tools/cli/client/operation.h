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
  std::string socket{};    ///< empty: the only gateway that answers in the default places
  Duration patience = 5s;  ///< how long to wait until the port is closed (or open again)
  /// Offers the port over the network at this ADDRESS:PORT; empty: offers it to a program on this
  /// machine.
  std::string tcp{};
  bool rfc2217 = false;
  /// Networks whose clients are allowed to connect to `tcp`, separated by blanks; empty: all
  /// networks.
  std::string allow{};
};

/// Releases the port and returns when it is closed, or with `end` when it is open again, so that a
/// script can go on. Exit codes: 0 done; 2 unknown line or a time out of range; 4 no gateway
/// answers, or the port does not close.
int RunRelease(const ReleaseOptions& options, std::ostream& out, std::ostream& err);

struct ReloadCommand {
  bool dry_run = false;
  /// The configuration must be confirmed within this time, or the gateway rolls it back; empty: no
  /// confirmation is needed.
  std::optional<Duration> confirm{};
  bool json = false;
  std::string socket;  ///< empty: the only gateway that answers in the default places
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

struct ReadOptions {
  std::string target;  ///< "LINE.DEVICE" or "LINE.DEVICE.POINT"
  bool json = false;
  std::string socket;  ///< empty: the only gateway that answers in the default places
  /// True: for a gateway that ends after this answer, so no advice is printed; the caller prints
  /// the reason of a failure.
  bool passing = false;
  bool unasked = false;  ///< true: the device sends unasked, so values that came since the
                         ///< gateway's start count as read
};

struct WriteOptions {
  std::string target;  ///< "LINE.DEVICE.POINT"
  std::string value;   ///< in the point's unit
  bool confirm = false;
  bool json = false;
  std::string socket;
  /// Client and number of the request: "NAME/NUMBER"; empty: the request has no number.
  std::string request{};
};

/// The exit code when the device did not answer, refused the request, or is not allowed to be
/// written.
inline constexpr int kNotDone = 1;

/// Exit codes: 0 all points were read now; kNotDone: some were not; 2 unknown target; 4 no gateway
/// answers.
int RunRead(const ReadOptions& options, std::ostream& out, std::ostream& err);

/// Exit codes: 0 the device has confirmed the write; kNotDone: it has not; 2 unknown target, or a
/// value that the point cannot have; 4 no gateway answers.
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
