// Finds the secrets of a request in what comes back after it: an echo that nobody took out, or a
// device that repeats what it was told, whole, in pieces or damaged. Used by
// gateway/trace/line_recorder.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "protocols/conversation.h"

namespace baudgate {

class SecretGuard {
 public:
  /// So long after an exchange its request is still looked for.
  static constexpr Duration kLinger = 5s;

  /// Every request and every end of an exchange goes through here.
  void OnSent(const Request& request, Instant now);
  void OnExchangeEnd(Instant now);
  /// What is received now may hold a secret.
  bool active(Instant now) const;
  /// Which of the bytes, received since the last call, are secret. All that belongs together should
  /// come in one call: a piece alone may not be recognised.
  std::vector<bool> Mask(View received);

  /// Which bytes of the request are secret.
  static std::vector<bool> MaskOf(const Request& request);

 private:
  struct Secret {
    Bytes request;
    std::vector<bool> secret;  // as request
    Instant until = Instant::max();
  };
  void Forget(Instant now);

  std::deque<Secret> secrets_;  // of the requests of late, the newest last
  bool newest_is_last_request_ = false;
  Bytes before_;  // received since the last request with secrets, as far as an echo may reach back
};

}  // namespace baudgate
