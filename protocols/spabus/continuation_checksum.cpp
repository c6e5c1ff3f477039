// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/continuation_checksum.h"

#include <utility>

namespace baudgate::protocols::spabus {
namespace {

constexpr int kDoubtsBeforeForgetting = 3;

}  // namespace

void ContinuationChecksum::Confirm(int matching) {
  doubts_ = 0;
  const int narrowed = accepted_ & matching;
  if (narrowed != 0) accepted_ = narrowed;
}

void ContinuationChecksum::Doubt() {
  if (++doubts_ >= kDoubtsBeforeForgetting) Forget();
}

char ContinuationChecksum::letter() const {
  for (const auto& [reading, letter] : {std::pair(kCoversAll, 'a'),
                                        {kCoversNoLineEnds, 'b'},
                                        {kCoversCharacters, 'c'},
                                        {kCoversLastLine, 'd'}}) {
    if (accepted_ == reading) return letter;
  }
  return 0;
}

void ContinuationChecksum::Forget() {
  accepted_ = kCoversAny;
  doubts_ = 0;
}

}  // namespace baudgate::protocols::spabus
