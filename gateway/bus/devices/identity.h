// What a device answers to the request that identifies it. Used by
// gateway/bus/replies/whose_reply.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"

namespace baudgate {

class Identity {
 public:
  bool known() const { return !reply_.empty(); }
  /// The device reports its name, and does not only refuse to.
  bool names() const { return known() && names_; }
  /// Whether this is the request that identifies the device.
  bool IsAskedBy(const Bytes& request) const { return known() && request == request_; }
  /// Whether these bytes are what it answers to that.
  bool Is(View reply) const;

  /// The request was answered like this, and the reply can be to no other request.
  void Learn(const Bytes& request, View reply, Outcome outcome);
  /// The request was answered by a reply that Is knows.
  void OnSame() {
    other_.clear();
    certain_ = true;
  }
  /// It has come more than once.
  bool certain() const { return certain_; }
  /// The request was answered otherwise. True: as the last time. Once may be damage, where replies
  /// carry no check value.
  bool OnOther(View reply);

 private:
  Bytes request_;
  Bytes reply_;
  Bytes other_;  // came last in place of reply_
  bool names_ = false;
  bool certain_ = false;
};

}  // namespace baudgate
