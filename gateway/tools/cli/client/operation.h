// Subcommands that act on a running gateway.
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
  /// Offers the port at this ADDRESS:PORT; empty: to a program on this machine.
  std::string tcp{};
  bool rfc2217 = false;
  /// Clients' networks, separated by blanks; empty: all.
  std::string allow{};
};

/// Returns when the port is closed, or with `end` open again. Exit codes: 0 done; 2 unknown line or
/// a time out of range; 4 no gateway answers, or the port does not close.
int RunRelease(const ReleaseOptions& options, std::ostream& out, std::ostream& err);

struct ReloadCommand {
  bool dry_run = false;
  /// Time for the confirmation, else the gateway rolls back; empty: none is needed.
  std::optional<Duration> confirm{};
  bool json = false;
  std::string socket;  ///< empty: the only gateway that answers in the default places
};

/// Exit codes: 0 applied, or with `dry_run` applicable; 2 the file has errors or needs a restart; 4
/// a port, the gateway or a disk fails. After 2 and 4 nothing was applied.
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
  /// For a gateway that ends after this answer: no advice, the caller prints a failure.
  bool passing = false;
  bool unasked = false;  ///< the device sends unasked: values since the start count as read
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

/// The exit code if the device did not answer, refused the request, or may not be written.
inline constexpr int kNotDone = 1;

/// Exit codes: 0 all points were read now; kNotDone: some were not; 2 unknown target; 4 no gateway
/// answers.
int RunRead(const ReadOptions& options, std::ostream& out, std::ostream& err);

/// Exit codes: 0 confirmed; kNotDone: not; 2 unknown target or invalid value; 4 no gateway answers.
int RunWrite(const WriteOptions& options, std::ostream& out, std::ostream& err);

// `baudgate enable` and `disable`: start or stop polling a device, until the gateway restarts.
struct InUseOptions {
  std::string target;  ///< "LINE.DEVICE"
  bool in_use = true;
  std::string socket;
};

/// Exit codes: 0 done; 2 unknown device; 4 no gateway answers.
int RunInUse(const InUseOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
