// The whole screen of a terminal for something that is drawn again and again, and as it was before
// when that ends. For `demo`, `watch` and `status --watch`; works over ssh, without a mouse.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <string_view>

#include "gateway/base/result.h"

namespace baudgate {

class LiveScreen {
 public:
  /// The error says why nothing can be drawn there: it is no terminal, or one that can only print
  /// line after line (TERM=dumb).
  static Status Possible(int descriptor);

  /// `out` goes to a terminal and outlives it.
  explicit LiveScreen(std::ostream& out);
  ~LiveScreen();
  LiveScreen(const LiveScreen&) = delete;
  LiveScreen& operator=(const LiveScreen&) = delete;

  /// Lines in place of those before, at most `height` (0: all): the last of them says how many more
  /// there are. In one piece, and only where something is another: nothing flickers.
  void Draw(std::string_view lines, std::size_t height);

 private:
  std::ostream& out_;
  std::string drawn_;
};

}  // namespace baudgate
