// The records of one name that a gateway keeps, page by page over its control socket: for
// `baudgate history`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <ostream>
#include <string>
#include <vector>

#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/history.h"

namespace baudgate {

class HistoryStream {
 public:
  using Json = ControlClient::Json;

  /// Client and `err` outlive it. `point`: LINE.DEVICE.POINT, or of what a meter has measured
  /// itself LINE.DEVICE.load_1.active_import.
  HistoryStream(ControlClient& client, const HistoryOptions& options, const std::string& point,
                std::ostream& err);

  /// The next record; null: there is none. The exit code when it cannot be read, which is told.
  int Next(const Json*& record);
  void Pop() { ++at_; }
  /// Files that could not be read so far, and why.
  const std::vector<std::string>& unread() const { return unread_; }

 private:
  int Fetch();

  ControlClient& client_;
  Json request_;
  std::ostream& err_;
  Json page_ = Json::array();
  std::vector<std::string> unread_;
  std::size_t at_ = 0;
  bool done_ = false;
};

}  // namespace baudgate
