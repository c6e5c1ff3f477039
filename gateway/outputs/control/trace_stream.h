// The trace of a line for one client: the records that the client wants.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "gateway/outputs/control/request.h"

namespace baudgate::control {

class TraceStream {
 public:
  TraceStream(TraceWish wish, std::shared_ptr<TraceQueue> queue)
      : wish_(std::move(wish)), queue_(std::move(queue)) {}

  std::uint32_t line() const { return wish_.line; }
  /// The records since the last call, one a line; empty: there are none. Records that nobody takes
  /// fill the queue, which then drops some and counts them.
  std::string Take();

 private:
  TraceWish wish_;
  std::shared_ptr<TraceQueue> queue_;
};

}  // namespace baudgate::control
