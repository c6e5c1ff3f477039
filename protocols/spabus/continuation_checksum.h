// Which reading of the checksum of continued replies the devices of a line use (reply.h). Shared by
// their conversations; each match narrows it down.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/spabus/reply.h"

namespace baudgate::protocols::spabus {

class ContinuationChecksum {
 public:
  /// Bits that a reply may match from now on.
  int accepted() const { return accepted_; }
  /// A continued reply passed; `matching` are the readings under which it did.
  void Confirm(int matching);
  /// A reply was damaged. Three in a row, and what was learned may itself be the mistake.
  void Doubt();
  void Forget();
  /// The reading that is left: 'a' to 'd'; 0 while there are several.
  char letter() const;

 private:
  int accepted_ = kCoversAny;
  int doubts_ = 0;
};

}  // namespace baudgate::protocols::spabus
