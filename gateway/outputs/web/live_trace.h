// A stream of what goes over a line: the frames of a trace as server-sent events.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/diagnosis/decode/frame_lines.h"
#include "gateway/outputs/web/request.h"
#include "gateway/records/trace/trace_text.h"

namespace baudgate::web {

class LiveTrace final : public Stream {
 public:
  explicit LiveTrace(Decoders decoders) : frames_(std::move(decoders)) {}
  /// Where its records come from; before the first Read.
  void SetQueue(std::shared_ptr<TraceQueue> queue) { queue_ = std::move(queue); }

  std::ptrdiff_t Read(std::span<char> into) override;
  void SetWake(std::function<void()> wake) override;

  // From any thread.

  /// There are records.
  void Wake();
  /// A sign of life, so that a client that has left is noticed.
  void Beat();
  void End();

 private:
  void Append(const std::vector<std::string>& frames);

  std::shared_ptr<TraceQueue> queue_;
  FrameLines frames_;
  std::string text_;
  std::size_t sent_ = 0;
  std::atomic<bool> beat_ = false;
  std::atomic<bool> ended_ = false;
  Mutex mutex_;
  std::function<void()> wake_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::web
