// SPDX-License-Identifier: Apache-2.0
#include "gateway/line/second_reply.h"

namespace baudgate {

bool SecondReply::IsAlone(const Bytes& frame, const Assembler& assembler) {
  taken_.clear();
  behind_ = assembler;
  while (const auto second = behind_.Next(false)) {
    if (*second != frame) return false;
  }
  return true;
}

bool SecondReply::OnBytes(View bytes) {
  if (taken_.empty()) return false;
  behind_.Feed(bytes);
  while (const auto second = behind_.Next(false)) {
    if (*second == taken_) continue;
    taken_.clear();
    return true;
  }
  return false;
}

}  // namespace baudgate
