// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/exchange.h"

#include <microhttpd.h>

namespace baudgate::web {

void Exchange::Resume() {
  if (!std::exchange(suspended_, false)) return;
  MHD_resume_connection(connection_);
}

std::optional<Response> Exchange::TakeOrSuspend() {
  const MutexLock lock(mutex_);
  if (response_) return std::exchange(response_, std::nullopt);
  if (ended_) return Problem(503, "the gateway stops");
  suspended_ = true;
  MHD_suspend_connection(connection_);
  return std::nullopt;
}

void Exchange::Answer(Response response) {
  const MutexLock lock(mutex_);
  if (completed_) return;
  response_ = std::move(response);
  Resume();
}

void Exchange::Attach(std::shared_ptr<Stream> stream) {
  stream_ = std::move(stream);
  stream_->SetWake([weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->Wake();
  });
}

std::ptrdiff_t Exchange::Read(std::span<char> into) {
  for (;;) {
    {
      const MutexLock lock(mutex_);
      if (ended_) return Stream::kEnd;
      woken_ = false;
    }
    const std::ptrdiff_t got = stream_->Read(into);
    if (got != 0) return got;
    const MutexLock lock(mutex_);
    if (woken_ || ended_) continue;
    suspended_ = true;
    MHD_suspend_connection(connection_);
    return 0;
  }
}

void Exchange::Wake() {
  const MutexLock lock(mutex_);
  woken_ = true;
  if (!completed_) Resume();
}

void Exchange::End() {
  const MutexLock lock(mutex_);
  ended_ = true;
  if (!completed_) Resume();
}

void Exchange::Complete() {
  std::shared_ptr<Stream> ends;
  const MutexLock lock(mutex_);
  completed_ = true;
  ends = std::move(stream_);  // it may be ended by another thread at the same time
}

}  // namespace baudgate::web
