// Keeps what a connection says before anything is asked: another service, a word of a server that
// is in use, or Telnet. The greeting explains why no device answers, until one does. A part of
// gateway/diagnosis/damage/examiner.h.
//
//   opened, "Login: ", a request, silence     the greeting explains it
//   opened, a request, "Login: "              the same: a server's words may meet the first request
//   opened, "Login: ", a request, its reply   forgotten: it has kept nobody from answering
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include "gateway/base/bytes.h"

namespace baudgate {

class ServerGreeting {
 public:
  void OnOpened() {
    first_ = true;
    text_.clear();
  }
  /// Bytes have come before the first request.
  void OnBytes(View bytes) {
    Append(text_, bytes.first(std::min(bytes.size(), kMost - text_.size())));
  }
  /// A device has answered. Returns what the connection had said until then; `heard`: with the
  /// reply.
  Bytes OnAnswered(View heard) {
    Bytes said = std::exchange(text_, {});
    if (said.empty() && first_) said.assign(heard.begin(), heard.end());
    return said;
  }
  /// An exchange has ended, whether answered or not. `speaks`: what was heard in it are words, or
  /// another service.
  void OnEnd(View heard, bool speaks) {
    const bool first = std::exchange(first_, false);
    if (first && speaks && text_.empty()) text_.assign(heard.begin(), heard.end());
  }

  /// Empty: it has said nothing, or a device has answered since.
  const Bytes& text() const { return text_; }

 private:
  static constexpr std::size_t kMost = 1024;

  Bytes text_;
  bool first_ = true;  // no exchange has ended since the port was opened
};

}  // namespace baudgate
