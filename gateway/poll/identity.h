// What a device answers to the request that identifies it. Kept by gateway/poll/whose_reply.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"

namespace baudgate {

class Identity {
 public:
  bool known() const { return !reply_.empty(); }
  /// The device tells its name, and does not merely refuse to.
  bool names() const { return known() && names_; }
  /// Whether this is the request that identifies the device.
  bool IsAskedBy(const Bytes& request) const { return known() && request == request_; }
  /// Whether these bytes are what it answers to that.
  bool Is(View reply) const;

  /// The request was answered so, and nothing else can have been.
  void Learn(const Bytes& request, View reply, Outcome outcome);

 private:
  Bytes request_;
  Bytes reply_;
  bool names_ = false;
};

}  // namespace baudgate
