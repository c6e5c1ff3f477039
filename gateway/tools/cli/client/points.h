// `baudgate read` and `baudgate write`: points of a running gateway's devices, asked now. RunInUse
// is `baudgate enable` and `baudgate disable`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <ostream>
#include <string>

namespace baudgate {

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

}  // namespace baudgate
