// SPDX-License-Identifier: Apache-2.0
#include "tests/system/tapped_cable.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <utility>

#include "gateway/base/text.h"
#include "tests/system/child.h"

namespace baudgate::system_test {
namespace {

std::string PassText(int from, int to) {
  std::array<char, 1024> buffer;
  const ssize_t count = ::read(from, buffer.data(), buffer.size());
  if (count <= 0) return {};
  const auto size = static_cast<std::size_t>(count);
  [[maybe_unused]] const ssize_t written = ::write(to, buffer.data(), size);
  return {buffer.data(), size};
}

}  // namespace

TappedCable::TappedCable(const std::string& near, const std::string& far) {
  auto pty = tools::Pty::Create(near);
  if (pty.ok()) pty_ = std::move(*pty);
  twin_ = ::open(far.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (connected()) thread_ = std::thread([this] { Carry(); });
}

TappedCable::~TappedCable() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  if (twin_ >= 0) ::close(twin_);
}

void TappedCable::Carry() {
  while (!stop_) {
    pollfd waited[] = {{pty_->master(), POLLIN, 0}, {twin_, POLLIN, 0}};
    ::poll(waited, 2, kPollMilliseconds);
    if ((waited[0].revents & POLLIN) != 0) {
      const std::string bytes = PassText(pty_->master(), twin_);
      const std::lock_guard lock(mutex_);
      heard_ += bytes;
    }
    if ((waited[1].revents & POLLIN) != 0) PassText(twin_, pty_->master());
  }
}

std::vector<std::string> TappedCable::Requests() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> requests;
  for (const std::string_view one : Split(heard_, '\r')) {
    if (!one.empty()) requests.emplace_back(one);
  }
  return requests;
}

}  // namespace baudgate::system_test
