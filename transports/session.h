// The read loop and the write queue of one open stream, the same for a tty and a TCP connection.
// Bytes come from the stream and go to its owner, and the other way round; used by the .cpp of a
// transport only.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <asio/buffer.hpp>
#include <asio/error.hpp>
#include <asio/post.hpp>
#include <asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <utility>

#include "gateway/base/bytes.h"

namespace baudgate {

/// More unsent bytes than this, and the other side is not taking data at all.
inline constexpr std::size_t kMostUnsent = 64 * 1024;
/// So long without one byte taken, and it never will.
inline constexpr std::chrono::seconds kStall{10};

/// Kept alive by its own pending operations; after Stop it calls nobody, so its owner may be gone.
template <typename Stream>
class Session : public std::enable_shared_from_this<Session<Stream>> {
 public:
  using OnRead = std::function<void(View)>;
  /// timed_out and no_buffer_space mean that the stream takes no data.
  using OnEnd = std::function<void(const std::error_code&)>;

  Session(Stream stream, OnRead on_read, OnEnd on_end)
      : stream_(std::move(stream)),
        stall_(stream_.get_executor()),
        on_read_(std::move(on_read)),
        on_end_(std::move(on_end)) {}

  Stream& stream() { return stream_; }
  void Start() { Read(); }

  /// No callback from now on. The stream is the caller's to close.
  void Stop() {
    stopped_ = true;
    stall_.cancel();
  }

  void Send(View bytes) {
    if (stopped_ || bytes.empty()) return;
    const std::size_t unsent = (in_flight_.size() - sent_) + queued_.size();
    if (bytes.size() > kMostUnsent - unsent) {
      asio::post(stream_.get_executor(),
                 [self = this->shared_from_this()] { self->End(asio::error::no_buffer_space); });
      return;
    }
    Append(queued_, bytes);
    if (!writing_) Write();
  }

 private:
  void Read() {
    stream_.async_read_some(
        asio::buffer(input_),
        [self = this->shared_from_this()](const std::error_code& error, std::size_t count) {
          if (self->stopped_) return;
          if (error) return self->End(error);
          self->on_read_(View(self->input_).first(count));
          if (!self->stopped_) self->Read();
        });
  }

  void Write() {
    if (sent_ == in_flight_.size()) {
      in_flight_.clear();
      sent_ = 0;
      std::swap(in_flight_, queued_);
    }
    writing_ = !in_flight_.empty();
    if (!writing_) {
      stall_.cancel();
      return;
    }
    ArmStall();
    stream_.async_write_some(
        asio::buffer(in_flight_.data() + sent_, in_flight_.size() - sent_),
        [self = this->shared_from_this()](const std::error_code& error, std::size_t count) {
          if (self->stopped_) return;
          if (error) return self->End(error);
          self->sent_ += count;
          self->Write();
        });
  }

  void ArmStall() {
    stall_.expires_after(kStall);
    stall_.async_wait([self = this->shared_from_this()](const std::error_code& error) {
      if (!error) self->End(asio::error::timed_out);
    });
  }

  void End(const std::error_code& error) {
    if (stopped_) return;
    Stop();
    on_end_(error);
  }

  Stream stream_;
  asio::steady_timer stall_;
  OnRead on_read_;
  OnEnd on_end_;
  std::array<std::uint8_t, 4096> input_{};
  Bytes in_flight_;  ///< must not move while an operation is pending
  std::size_t sent_ = 0;
  Bytes queued_;
  bool writing_ = false;
  bool stopped_ = false;
};

}  // namespace baudgate
