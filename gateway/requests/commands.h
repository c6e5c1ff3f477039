// The one way from an output back to a line: a write that waits in the line's queue until the
// device has confirmed it, refused it, or its deadline has passed. Who makes a command has
// converted and checked its values: a client's registers "00 19" of a point with scale 0.1 are 25,
// which is 250 for the device (gateway/modbus/registers/write_request.h). From here on nothing
// converts them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"

namespace baudgate {

struct PointWrite {
  std::uint32_t point = 0;  ///< index in the device's points
  Value raw;                ///< as the conversation sends it: made by ToRaw, and so in range
};

/// Several points are written in their order; the first that fails ends the command.
struct WriteCommand {
  std::uint32_t device = 0;  ///< index in the point store
  std::vector<PointWrite> writes;
  Instant deadline;            ///< nothing is sent later; answered no_reply when it passes
  std::uint64_t sequence = 0;  ///< the line's own: its place among all writes to the line
  /// True: nobody waits for it any more, and it is not begun.
  std::shared_ptr<const std::atomic<bool>> dropped;
  /// Called exactly once, on the line's thread, unless Submit said no. `reason` is empty when ok.
  std::function<void(Outcome, const std::string& reason)> done;
};

class CommandSink {
 public:
  virtual ~CommandSink() = default;
  /// From any thread. False: the line's queue is full, or it is stopping; `done` is not called.
  virtual bool Submit(WriteCommand command) = 0;
};

}  // namespace baudgate
