// `KeepingSink` stores submitted writes in place of the lines.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "gateway/bus/writes/write_command.h"

namespace baudgate {

class KeepingSink final : public bus::CommandSink {
 public:
  bool Submit(bus::WriteCommand command) override {
    if (full) return false;
    commands.push_back(std::move(command));
    return true;
  }
  void OnNotTaken(const bus::DeniedWrite& write) override { denied.push_back(write); }

  bool full = false;
  std::vector<bus::WriteCommand> commands;
  std::vector<bus::DeniedWrite> denied;
};

}  // namespace baudgate
