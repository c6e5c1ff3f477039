// Records that a gateway keeps, page by page: all that are there and, if wanted, what comes. For
// `baudgate writes`, `baudgate events` and `baudgate alarms`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <ostream>
#include <string>

#include "gateway/base/time.h"
#include "gateway/tools/cli/client/control_client.h"

namespace baudgate {

inline constexpr int kNotCurrent = 4;

struct RecordPages {
  ControlClient::Json request;  ///< of the first page
  const char* state = "";       ///< the key under which an answer says how the file is
  bool follow = false;
  std::optional<Duration> seconds{};  ///< of `follow`: end after this time
  std::string socket{};               ///< empty: the gateway in the default places
  /// They count only while the file can be written: else kNotCurrent.
  bool current = false;
  /// With `follow`: print everything again, not only what is new; `looked` is called at its end.
  bool whole = false;
  std::function<void()> looked{};
};

/// `print`: what stands in each page, which may be nothing. The exit code.
int ReadPages(const RecordPages& pages,
              const std::function<void(const ControlClient::Json& records)>& print,
              std::ostream& out, std::ostream& err);

/// A field as it may be shown; empty where it is not there.
std::string FieldText(const ControlClient::Json& record, const char* key);

}  // namespace baudgate
