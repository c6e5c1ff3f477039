// A gateway for the Modbus targets: devices with points of every type, table and access, values of
// every kind, lines that answer writes at once, and the promises that every answer keeps.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>

#include "config/config.h"
#include "gateway/commands.h"
#include "gateway/modbus/service.h"
#include "gateway/point_store.h"

namespace baudgate::fuzz {

/// Kept for ever.
const config::Config& ModbusConfig();
PointStore& FilledStore();
/// Between the values' times: some are young, some old, some were never read.
Instant ModbusNow();

/// Takes, refuses or keeps writes, by turns that the input sets.
class FuzzSink final : public CommandSink {
 public:
  bool Submit(WriteCommand command) override;

  std::uint8_t turn = 0;
  std::deque<WriteCommand> kept;  ///< not answered yet
};

/// `answer` is a whole frame that answers `request`: the same ids and function, or an exception,
/// and as long as it says.
void CheckModbusAnswer(View request, View answer);

}  // namespace baudgate::fuzz
