// Whether a line may begin anything new. A part of gateway/poll/poller.h.
//
//   held by       until
//   WindUp        the port opens again, or CallOffWindUp: it is given up as soon as the write under
//                 way has ended
//   Pause         GoOn, or the port closes: the line is wanted for something else meanwhile
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

namespace baudgate {

class Hold {
 public:
  void OnOpened() { winding_up_ = paused_ = false; }
  void OnClosed() { paused_ = false; }
  void WindUp() { winding_up_ = true; }
  void CallOffWindUp() { winding_up_ = false; }
  void Pause() { paused_ = true; }
  /// False: there was no pause.
  bool GoOn() { return std::exchange(paused_, false); }

  bool holds() const { return winding_up_ || paused_; }

 private:
  bool winding_up_ = false;
  bool paused_ = false;
};

}  // namespace baudgate
