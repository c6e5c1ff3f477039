// Looks behind a reply for a second, different one: then one of the two belongs to another request,
// and which one is not known. Copies do no harm. A part of gateway/bus/exchange/line.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/bytes.h"
#include "protocols/assembler.h"

namespace baudgate {

/// A text without a value between two line ends, as a console sends it, is no second reply.
bool IsEmptyLine(View frame);

class SecondReply {
 public:
  /// A request goes out. What comes from now on is compared with nothing until Take.
  void Begin() { taken_.clear(); }
  /// `frame` was cut from `assembler`. False: a whole frame that differs is behind it there.
  bool IsAlone(const Bytes& frame, const Assembler& assembler);
  /// The frame that was alone was taken for the reply.
  void Take(const Bytes& frame) { taken_ = frame; }
  /// Bytes that came after it. True: a whole frame that differs is there. Told once.
  bool OnBytes(View bytes);
  /// Nothing has come after the frame but whole copies of it.
  bool only_copies() const { return behind_.held() == 0; }

 private:
  /// Empty: no reply was taken, or a second one was told already.
  Bytes taken_;
  Assembler behind_;  // bytes after the frame
};

}  // namespace baudgate
