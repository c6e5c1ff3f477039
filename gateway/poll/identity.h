// What a device answers to the request that identifies it, and whether it is still the one that
// did. Used by gateway/poll/whose_reply.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "protocols/conversation.h"

namespace baudgate {

class Identity {
 public:
  bool known() const { return !reply_.empty(); }
  /// Whether this is the request that identifies the device.
  bool IsAskedBy(const Request& request) const { return request.bytes == request_; }

  /// A request goes out: the next answer is not the one to the identification any more.
  void OnSent(const Request& request) {
    if (!IsAskedBy(request)) other_seen_ = 0;
  }
  /// A steady probe was answered when nothing else could have been: it names the device from now
  /// on.
  void Learn(const Request& probe, View reply);
  /// A probe of the device was answered, and its answers may be in step. Answers that never are the
  /// identification end it.
  void OnProbeAnswered(const Request& probe);
  /// Whether the reply is that to the identification. May come to believe that the device has been
  /// replaced by one of another kind: then it is, too.
  bool Matches(const Request& request, View reply, Outcome outcome);

 private:
  Bytes request_;         // the steady probe that was answered first
  Bytes reply_;           // to it, ever since; empty: none yet
  Bytes other_reply_;     // to it, of late
  int other_seen_ = 0;    // how often in a row
  int other_probes_ = 0;  // answered since request_ was
};

}  // namespace baudgate
