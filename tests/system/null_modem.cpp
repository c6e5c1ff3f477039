// SPDX-License-Identifier: Apache-2.0
#include "tests/system/null_modem.h"

#include <poll.h>
#include <unistd.h>

#include <array>

#include "tests/system/child.h"

namespace baudgate::system_test {
namespace {

std::uint64_t Pass(int from, int to) {
  std::array<std::uint8_t, 1024> buffer;
  const ssize_t count = ::read(from, buffer.data(), buffer.size());
  if (count <= 0) return 0;
  const ssize_t written = ::write(to, buffer.data(), static_cast<std::size_t>(count));
  return written > 0 ? static_cast<std::uint64_t>(written) : 0;
}

}  // namespace

NullModem::NullModem(const std::string& near, const std::string& far) {
  auto one = tools::Pty::Create(near);
  auto other = tools::Pty::Create(far);
  if (one.ok()) near_ = std::move(*one);
  if (other.ok()) far_ = std::move(*other);
  if (connected()) thread_ = std::thread([this] { Carry(); });
}

NullModem::~NullModem() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

void NullModem::Carry() {
  while (!stop_) {
    pollfd waited[] = {{near_->master(), POLLIN, 0}, {far_->master(), POLLIN, 0}};
    ::poll(waited, 2, kPollMilliseconds);
    if ((waited[0].revents & POLLIN) != 0) bytes_to_far_ += Pass(near_->master(), far_->master());
    if ((waited[1].revents & POLLIN) != 0) bytes_to_near_ += Pass(far_->master(), near_->master());
  }
}

}  // namespace baudgate::system_test
