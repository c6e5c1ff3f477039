// `StreamPump` is the read loop and write queue of one open stream, a tty or a TCP connection. The
// transports and the network clients of a lent port use it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/buffer.hpp>
#include <asio/error.hpp>
#include <asio/post.hpp>
#include <asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"

namespace baudgate::transports {

/// The maximum number of unsent bytes; beyond it the other side counts as accepting no data.
inline constexpr std::size_t kMostUnsent = 64 * 1024;
/// The maximum time without progress while bytes wait to be written.
inline constexpr Duration kStall = 10s;

/// The pending operations keep the pump alive. After Stop the pump makes no callback, so its owner
/// can be destroyed.
template <typename Stream>
class StreamPump : public std::enable_shared_from_this<StreamPump<Stream>> {
 public:
  using OnRead = std::function<void(View)>;
  /// The errors timed_out and no_buffer_space mean that the stream accepts no data.
  using OnStreamEnd = std::function<void(const std::error_code&)>;
  using OnRoom = std::function<void()>;

  /// `stall`: the time without one byte written after which the stream counts as stuck.
  StreamPump(Stream stream, OnRead on_read, OnStreamEnd on_end, OnRoom on_room = {},
             Duration stall = kStall, std::size_t read_at_most = 4096)
      : stream_(std::move(stream)),
        stall_(stream_.get_executor()),
        on_read_(std::move(on_read)),
        on_end_(std::move(on_end)),
        on_room_(std::move(on_room)),
        stall_time_(stall),
        input_(read_at_most) {}

  Stream& stream() { return stream_; }
  void Start() {
    // In non-blocking mode a write takes only what fits now, so DropUnsent finds no pending write.
    std::error_code error;
    stream_.non_blocking(true, error);
    if (error) return EndSoon(error);
    if (!paused_) Read();
  }

  /// Stops or resumes reading. A read that has already begun still delivers its bytes.
  void Pause(bool paused) {
    paused_ = paused;
    if (!paused && !stopped_) Read();
  }
  /// If `patient`, the stream may accept no data for any time, else only for `stall`.
  void SetPatient(bool patient) {
    patient_ = patient;
    if (patient) stall_.cancel();
    if (!patient && !queue_.empty()) ArmStall();
  }

  /// No callback is made after this call. The caller must close the stream.
  void Stop() {
    stopped_ = true;
    stall_.cancel();
  }

  void Send(View bytes) {
    if (stopped_ || bytes.empty()) return;
    if (bytes.size() > kMostUnsent - queue_.size()) return EndSoon(asio::error::no_buffer_space);
    if (queue_.empty()) ArmStall();
    Append(queue_, bytes);
    // Write is called even while AwaitRoom waits, because a flushed pty does not report its room.
    Write();
  }

  /// Discards the bytes that the stream has not accepted. Returns false if there were no such
  /// bytes.
  bool DropUnsent() {
    if (queue_.empty()) return false;
    queue_.clear();
    stall_.cancel();
    return true;
  }
  /// Returns the number of bytes that the stream has accepted in total.
  std::uint64_t taken() const { return taken_; }
  std::size_t unsent() const { return queue_.size(); }

  /// Ends the pump as if the stream had failed with `error`, after the current handler has
  /// returned.
  void EndSoon(const std::error_code& error) {
    asio::post(stream_.get_executor(),
               [self = this->shared_from_this(), error] { self->End(error); });
  }

 private:
  void Read() {
    if (std::exchange(reading_, true)) return;
    stream_.async_read_some(
        asio::buffer(input_),
        [self = this->shared_from_this()](const std::error_code& error, std::size_t count) {
          if (self->stopped_) return;
          if (error) return self->End(error);
          self->on_read_(View(self->input_).first(count));
          self->reading_ = false;
          if (!self->stopped_ && !self->paused_) self->Read();
        });
  }

  void Write() {
    std::error_code error;
    const std::size_t count = stream_.write_some(asio::buffer(queue_), error);
    if (error && error != asio::error::would_block) return EndSoon(error);
    taken_ += count;
    queue_.erase(queue_.begin(), queue_.begin() + static_cast<std::ptrdiff_t>(count));
    if (queue_.empty()) {
      stall_.cancel();
      return;
    }
    if (count > 0) ArmStall();
    AwaitRoom();
  }

  void OnWritable() {
    if (!queue_.empty()) Write();
    if (queue_.empty() && on_room_) on_room_();
  }

  void AwaitRoom() {
    if (std::exchange(waiting_, true)) return;
    stream_.async_wait(Stream::wait_write,
                       [self = this->shared_from_this()](const std::error_code& error) {
                         self->waiting_ = false;
                         if (self->stopped_) return;
                         if (error) return self->End(error);
                         self->OnWritable();
                       });
  }

  void ArmStall() {
    if (patient_) return;
    stall_.expires_after(stall_time_);
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
  OnStreamEnd on_end_;
  OnRoom on_room_;
  const Duration stall_time_;
  Bytes input_;
  Bytes queue_;
  std::uint64_t taken_ = 0;
  bool waiting_ = false;  ///< true: a wait for room is pending
  bool reading_ = false;
  bool paused_ = false;
  bool patient_ = false;
  bool stopped_ = false;
};

}  // namespace baudgate::transports
