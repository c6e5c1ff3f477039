// SPDX-License-Identifier: Apache-2.0
#include "tests/system/bad_cable.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "gateway/base/time.h"
#include "tests/system/child.h"

namespace baudgate::system_test {
namespace {

// The longest pause between two pieces of a reply, in ms. It is shorter than the gap of every
// protocol.
constexpr int kMostDelay = 15;
constexpr int kMostNoise = 24;

void WriteAll(int descriptor, View bytes) {
  [[maybe_unused]] const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
}

}  // namespace

BadCable::BadCable(const std::string& near, const std::string& far, std::uint32_t seed)
    : random_(seed) {
  auto pty = tools::Pty::Create(near);
  if (pty.ok()) pty_ = std::move(*pty);
  twin_ = ::open(far.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (connected()) thread_ = std::thread([this] { Carry(); });
}

BadCable::~BadCable() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  if (twin_ >= 0) ::close(twin_);
}

int BadCable::Random(int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(random_);
}

void BadCable::Carry() {
  std::array<std::uint8_t, 1024> buffer;
  while (!stop_) {
    pollfd waited[] = {{pty_->master(), POLLIN, 0}, {twin_, POLLIN, 0}};
    ::poll(waited, 2, kPollMilliseconds);
    if ((waited[0].revents & POLLIN) != 0) {
      const ssize_t count = ::read(pty_->master(), buffer.data(), buffer.size());
      if (count > 0) WriteAll(twin_, View(buffer).first(static_cast<std::size_t>(count)));
    }
    if ((waited[1].revents & POLLIN) != 0) {
      const ssize_t count = ::read(twin_, buffer.data(), buffer.size());
      if (count > 0) CarryReply(View(buffer).first(static_cast<std::size_t>(count)));
    } else if (noisy_ && Random(0, 9) == 0) {
      MakeNoise();
    }
  }
}

void BadCable::CarryReply(View whole) {
  Bytes damaged(whole.begin(), whole.end());
  if (noisy_) Damage(damaged);
  View reply = damaged;
  while (!reply.empty()) {
    const auto piece = std::min(reply.size(), static_cast<std::size_t>(Random(1, 12)));
    WriteAll(pty_->master(), reply.first(piece));
    reply = reply.subspan(piece);
    if (!reply.empty()) std::this_thread::sleep_for(Random(0, kMostDelay) * 1ms);
  }
}

/// Changes at most one byte, because several changes could cancel each other in an exclusive-or.
void BadCable::Damage(Bytes& reply) {
  if (Random(0, 4) == 0) MakeNoise();
  const auto place = static_cast<std::size_t>(Random(0, static_cast<int>(reply.size()) - 1));
  if (const int choice = Random(0, 9); choice == 0) {
    reply[place] ^= static_cast<std::uint8_t>(Random(1, 255));
  } else if (choice == 1) {
    reply.resize(place);
  }
}

void BadCable::MakeNoise() {
  Bytes noise(static_cast<std::size_t>(Random(1, kMostNoise)));
  for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(Random(0, 255));
  WriteAll(pty_->master(), noise);
  noise_bytes_ += noise.size();
}

}  // namespace baudgate::system_test
