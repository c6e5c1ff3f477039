// Whether a relay is what its profile says, by its designation (item F):
//
//   > >7RF:    < <7D: SPAJ 140C:      it is asked before the first poll
//                                     another name: it is asked for nothing else until it is right
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "config/model/device.h"
#include "protocols/conversation.h"

namespace baudgate::protocols::spabus {

class RelayIdentity {
 public:
  /// It outlives this.
  explicit RelayIdentity(const config::Identity& identity) : identity_(identity) {}

  /// A request is asked for: an earlier one that waits will be asked for again.
  void OnAsk() { asked_ = false; }
  /// True: the next request asks for the name.
  bool WantsName();
  /// The request under way asks for the name, and is answered or has failed.
  bool TakeAsked() { return std::exchange(asked_, false); }
  Answer TakeName(Answer answer);
  /// Silence contradicts nothing; the next poll asks for values.
  void OnNoName() { named_ = true; }
  void OnReconnect() { named_ = false; }
  const DeviceTrouble& trouble() const { return trouble_; }

 private:
  const config::Identity& identity_;
  bool named_ = false;  ///< it has said what it is, since OnReconnect
  bool asked_ = false;
  DeviceTrouble trouble_;
};

}  // namespace baudgate::protocols::spabus
