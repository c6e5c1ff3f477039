// The requests `reload` and `confirm` of the control socket: who asks is answered when the reload
// has ended, well or not. Implemented by gateway/daemon/reloader.h.
//
//   {"command":"reload","dry_run":false,"confirm_ms":60000}
//   {"ok":true,"applied":true,"changes":["line bay-1: begins anew: poll of feeder-1"],
//    "warnings":[],"text":"1 line begun anew; 3 lines untouched"}
//   {"ok":false,"exit":2,"text":"…baudgate.yaml:7:3: …"}
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gateway/base/time.h"

namespace baudgate::control {

struct ReloadAsk {
  bool dry_run = false;
  Duration confirm{};  ///< zero: it needs no confirmation
  std::string by;      ///< "user:anna"
};

struct ReloadAnswer {
  bool ok = false;
  bool applied = false;                 ///< something is another than before
  int exit_code = 0;                    ///< of the command: 2: a bad file, 4: it cannot be had
  std::vector<std::string> changes;     ///< one sentence each
  std::vector<std::string> warnings{};  ///< of the file: "…baudgate.yaml:7:3: warning: …"
  std::string text;                     ///< one or more lines
  Duration confirm{};                   ///< time left for it; zero: it needs none
};

class ReloadService {
 public:
  using Answered = std::function<void(const ReloadAnswer&)>;
  virtual ~ReloadService() = default;
  /// From any thread; `answered` once, on any thread.
  virtual void Reload(const ReloadAsk& ask, Answered answered) = 0;
  /// What was applied stays.
  virtual void Confirm(const std::string& by, Answered answered) = 0;
};

}  // namespace baudgate::control
