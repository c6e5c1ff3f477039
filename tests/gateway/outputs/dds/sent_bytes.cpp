// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/outputs/dds/sent_bytes.h"

#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <mutex>

namespace baudgate::dds::testing {
namespace {

std::mutex recording;
std::string* recorded = nullptr;

}  // namespace

void Record(const void* bytes, std::size_t size) {
  const std::lock_guard lock(recording);
  if (recorded != nullptr) recorded->append(static_cast<const char*>(bytes), size);
}

SentBytes::SentBytes() {
  const std::lock_guard lock(recording);
  recorded = new std::string;
}

SentBytes::~SentBytes() {
  const std::lock_guard lock(recording);
  delete recorded;
  recorded = nullptr;
}

std::string SentBytes::All() const {
  const std::lock_guard lock(recording);
  return *recorded;
}

}  // namespace baudgate::dds::testing

extern "C" {

ssize_t sendmsg(int socket, const struct msghdr* message, int flags) {
  for (std::size_t i = 0; i < message->msg_iovlen; ++i) {
    baudgate::dds::testing::Record(message->msg_iov[i].iov_base, message->msg_iov[i].iov_len);
  }
  return ::syscall(SYS_sendmsg, socket, message, flags);
}

ssize_t sendto(int socket, const void* bytes, size_t size, int flags, const struct sockaddr* to,
               socklen_t to_size) {
  baudgate::dds::testing::Record(bytes, size);
  return ::syscall(SYS_sendto, socket, bytes, size, flags, to, to_size);
}
}
