// What a device answers to the request that identifies it. Used by gateway/poll/whose_reply.cpp.
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

 private:
  Bytes request_;
  Bytes reply_;
  bool names_ = false;
};

}  // namespace baudgate
