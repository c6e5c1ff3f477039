// Helpers of the transport tests: a recording listener, the far end of a wire, and waiting for
// events.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <asio/buffer.hpp>
#include <asio/io_context.hpp>
#include <asio/write.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "transports/transport.h"

namespace baudgate::test {

inline bool RunUntil(asio::io_context& io, const std::function<bool()>& condition) {
  const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!condition()) {
    if (std::chrono::steady_clock::now() >= limit) return false;
    io.restart();
    io.run_one_until(limit);
  }
  return true;
}

inline void RunReady(asio::io_context& io) {
  for (int round = 0; round < 10; ++round) {
    io.restart();
    io.poll();
  }
}

class Recorder : public transports::TransportListener {
 public:
  void OnOpened() override { ++opened; }
  void OnOpenFailed(const std::string& reason) override { failures.push_back(reason); }
  void OnBytes(View bytes) override {
    Append(received, bytes);
    if (on_bytes) on_bytes();
  }
  void OnLost(const std::string& reason) override {
    losses.push_back(reason);
    if (on_lost) on_lost();
  }

  int opened = 0;
  std::vector<std::string> failures;
  std::vector<std::string> losses;
  Bytes received;
  std::function<void()> on_bytes;
  std::function<void()> on_lost;
};

/// The device's side of the wire: after Start() it reads continuously, and it writes on Write().
template <typename Stream>
class FarEnd {
 public:
  explicit FarEnd(Stream stream) : state_(std::make_shared<State>(std::move(stream))) {}

  void Start() { Read(state_); }
  void Write(Bytes bytes) {
    auto kept = std::make_shared<Bytes>(std::move(bytes));
    asio::async_write(state_->stream, asio::buffer(*kept),
                      [state = state_, kept](const std::error_code&, std::size_t) {});
  }
  Stream& stream() { return state_->stream; }
  const Bytes& received() const { return state_->received; }
  bool ended() const { return static_cast<bool>(state_->end); }
  const std::error_code& end() const { return state_->end; }

 private:
  struct State {
    explicit State(Stream s) : stream(std::move(s)) {}
    Stream stream;
    Bytes received;
    std::error_code end;
    std::array<std::uint8_t, 4096> buffer{};
  };

  static void Read(const std::shared_ptr<State>& state) {
    state->stream.async_read_some(asio::buffer(state->buffer),
                                  [state](const std::error_code& error, std::size_t count) {
                                    Append(state->received, View(state->buffer).first(count));
                                    state->end = error;
                                    if (!error) Read(state);
                                  });
  }

  std::shared_ptr<State> state_;
};

inline Bytes AllBytes() {
  Bytes bytes;
  for (int value = 0; value < 256; ++value) bytes.push_back(static_cast<std::uint8_t>(value));
  return bytes;
}

/// Calls `check` with every fragmentation of `whole`; for short sequences only.
inline void EachFragmentation(const Bytes& whole,
                              const std::function<void(const std::vector<Bytes>&)>& check) {
  const unsigned cuts = static_cast<unsigned>(whole.size()) - 1;
  for (unsigned mask = 0; mask < (1U << cuts); ++mask) {
    std::vector<Bytes> pieces(1);
    for (std::size_t i = 0; i < whole.size(); ++i) {
      pieces.back().push_back(whole[i]);
      if (i < cuts && ((mask >> i) & 1U) != 0) pieces.emplace_back();
    }
    check(pieces);
  }
}

}  // namespace baudgate::test
