// The read loop and the write queue of one open stream, the same for a tty and a TCP connection.
// Bytes come from the stream and go to its owner, and the other way round; used by transports and
// for the clients of a served port.
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

/// More unsent bytes than this, and the other side is not taking data at all.
inline constexpr std::size_t kMostUnsent = 64 * 1024;
/// How long a port may take no byte.
inline constexpr Duration kStall = 10s;

/// Kept alive by its own pending operations; after Stop it calls nothing, so its owner may be gone.
template <typename Stream>
class StreamPump : public std::enable_shared_from_this<StreamPump<Stream>> {
 public:
  using OnRead = std::function<void(View)>;
  /// timed_out and no_buffer_space mean that the stream takes no data.
  using OnStreamEnd = std::function<void(const std::error_code&)>;
  using OnRoom = std::function<void()>;

  /// `stall`: so long without one byte taken, and no more will be.
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
    // Bytes are written when there is room, never left with an operation that might do so later.
    std::error_code error;
    stream_.non_blocking(true, error);
    if (error) return EndSoon(error);
    if (!paused_) Read();
  }

  /// Nothing is read while paused, but what is on its way already.
  void Pause(bool paused) {
    paused_ = paused;
    if (!paused && !stopped_) Read();
  }
  /// The other side may take its time.
  void SetPatient(bool patient) {
    patient_ = patient;
    if (patient) stall_.cancel();
    if (!patient && !queue_.empty()) ArmStall();
  }

  /// No callback from now on. The stream is the caller's to close.
  void Stop() {
    stopped_ = true;
    stall_.cancel();
  }

  void Send(View bytes) {
    if (stopped_ || bytes.empty()) return;
    if (bytes.size() > kMostUnsent - queue_.size()) return EndSoon(asio::error::no_buffer_space);
    if (queue_.empty()) ArmStall();
    Append(queue_, bytes);
    // Even while waiting for room: a pty that has been flushed has some, and wakes nobody.
    Write();
  }

  /// Forgets what the stream has not taken; says whether there was anything.
  bool DropUnsent() {
    if (queue_.empty()) return false;
    queue_.clear();
    stall_.cancel();
    return true;
  }
  /// How many bytes the stream has taken altogether.
  std::uint64_t taken() const { return taken_; }
  std::size_t unsent() const { return queue_.size(); }

  /// The end, as of an error of the stream, but not from within the caller's call.
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
  Bytes queue_;  ///< what the stream has not taken
  std::uint64_t taken_ = 0;
  bool waiting_ = false;  ///< for room in the stream
  bool reading_ = false;  ///< an operation is under way
  bool paused_ = false;
  bool patient_ = false;
  bool stopped_ = false;
};

}  // namespace baudgate::transports
