// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/exchange/second_reply.h"

#include <algorithm>

#include "gateway/base/text.h"

namespace baudgate {

bool IsEmptyLine(View frame) { return std::ranges::all_of(frame, IsLineEnd); }

bool SecondReply::IsAlone(const Bytes& frame, const Assembler& assembler) {
  taken_.clear();
  behind_ = assembler;
  while (const auto second = behind_.Next(false)) {
    if (*second != frame && !IsEmptyLine(*second)) return false;
  }
  return true;
}

bool SecondReply::OnBytes(View bytes) {
  if (taken_.empty()) return false;
  behind_.Feed(bytes);
  while (const auto second = behind_.Next(false)) {
    if (*second == taken_ || IsEmptyLine(*second)) continue;
    taken_.clear();
    return true;
  }
  return false;
}

}  // namespace baudgate
