// `Journald` stands for journald: a socket that receives the log of this process.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "gateway/base/log.h"

namespace baudgate {

class Journald {
 public:
  Journald() : socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    std::string form = (std::filesystem::temp_directory_path() / "baudgate-log-XXXXXX").string();
    folder_ = ::mkdtemp(form.data());
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path().copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  ~Journald() {
    ::close(socket_);
    std::filesystem::remove_all(folder_);
  }
  /// Redirects the log to this socket. Must be called at most once in a process.
  void TakeLog() const {
    struct stat info {};
    ASSERT_EQ(::fstat(STDERR_FILENO, &info), 0);
    ::setenv("JOURNAL_STREAM", fmt::format("{}:{}", info.st_dev, info.st_ino).c_str(), 1);
    log::Begin(log::Level::info, path());
    ::unsetenv("JOURNAL_STREAM");
  }
  std::string path() const { return folder_ / "socket"; }
  std::string Next() const {
    char buffer[4096];
    const ssize_t count = ::recv(socket_, buffer, sizeof buffer, MSG_DONTWAIT);
    return count > 0 ? std::string(buffer, static_cast<std::size_t>(count)) : std::string();
  }

 private:
  int socket_;
  std::filesystem::path folder_;
};

}  // namespace baudgate
