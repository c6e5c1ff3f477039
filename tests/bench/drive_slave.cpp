// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/drive_slave.h"

#include <poll.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>

#include "gateway/base/text.h"

namespace baudgate::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr Duration kThink = 5ms;

}  // namespace

Drive::Drive(const protocols::Protocol& rtu, const config::Device& device,
             const config::SerialSettings& serial)
    : pty_(std::move(*tools::Pty::Create())),
      character_(serial.CharacterTime()),
      values_(device),
      twin_(rtu.make_twin(device, values_)),
      thread_([this] { Run(); }) {}

Drive::~Drive() {
  stop_ = true;
  thread_.join();
}

std::vector<OnWire> Drive::log() const {
  const std::lock_guard lock(mutex_);
  return log_;
}

void Drive::Run() {
  prctl(PR_SET_TIMERSLACK, 1UL);
  Bytes buffer(512);
  Instant quiet_since{};
  while (!stop_) {
    pollfd ready{pty_.master(), POLLIN, 0};
    if (poll(&ready, 1, 100) <= 0) continue;
    const Instant from = Clock::now();
    const ssize_t count = read(pty_.master(), buffer.data(), buffer.size());
    if (count <= 0) continue;
    const View request = View(buffer).first(static_cast<std::size_t>(count));
    bytes_in += request.size();
    if (from - quiet_since < 7 * character_ / 2) ++short_silences;
    {
      const std::lock_guard lock(mutex_);
      log_.push_back(
          {from, ToHex(request.subspan(1, std::min<std::size_t>(request.size() - 3, 5)))});
    }
    quiet_since =
        Answer(request, from + static_cast<std::int64_t>(request.size()) * character_ + kThink);
  }
}

Instant Drive::Answer(View request, Instant begin) {
  std::this_thread::sleep_until(begin);
  const Bytes reply = twin_->Answer(request, Clock::now());
  View rest = reply;
  Instant at = begin;
  while (!rest.empty()) {
    const View piece = rest.first(std::min<std::size_t>(rest.size(), 32));
    at += static_cast<std::int64_t>(piece.size()) * character_;
    std::this_thread::sleep_until(at);
    pollfd ready{pty_.master(), POLLIN, 0};
    if (poll(&ready, 1, 0) > 0) ++overlaps;
    at = Clock::now();
    if (write(pty_.master(), piece.data(), piece.size()) < 0) return at;
    bytes_out += piece.size();
    rest = rest.subspan(piece.size());
  }
  return at;
}

}  // namespace baudgate::bench
