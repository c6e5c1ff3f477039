// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/journal.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>

namespace baudgate::log {
namespace {

/// A value of several lines has its length, eight bytes, least first, in place of '='.
void AddField(std::string& message, const std::string& name, const std::string& value) {
  if (value.empty()) return;
  message += name;
  if (value.find('\n') == std::string::npos) {
    message += '=';
  } else {
    message += '\n';
    for (unsigned shift = 0; shift < 64; shift += 8) {
      message += static_cast<char>((static_cast<std::uint64_t>(value.size()) >> shift) & 0xFF);
    }
  }
  message += value + "\n";
}

}  // namespace

int Priority(Level level) {
  constexpr int kPriorities[] = {7, 6, 4, 3};
  return kPriorities[static_cast<std::size_t>(level)];
}

bool IsJournal(int descriptor) {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat info {};
  if (stream == nullptr || ::fstat(descriptor, &info) != 0) return false;
  return fmt::format("{}:{}", info.st_dev, info.st_ino) == stream;
}

std::string JournalMessage(Level level, const About& about, const std::string& text) {
  std::string message;
  AddField(message, "MESSAGE", text);
  AddField(message, "PRIORITY", std::to_string(Priority(level)));
  AddField(message, "SYSLOG_IDENTIFIER", "baudgate");
  AddField(message, "LINE", about.line);
  AddField(message, "DEVICE", about.device);
  AddField(message, "OUTCOME", about.outcome);
  for (const auto& [name, value] : about.fields) AddField(message, name, value);
  return message;
}

Journal::Journal(std::string socket)
    : path_(std::move(socket)), socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}

Journal::~Journal() {
  if (socket_ >= 0) ::close(socket_);
}

bool Journal::Send(Level level, const About& about, const std::string& text) const {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path_.size() >= sizeof address.sun_path) return false;
  path_.copy(address.sun_path, path_.size());
  const std::string message = JournalMessage(level, about, text);
  const auto* to = reinterpret_cast<const sockaddr*>(&address);
  return ::sendto(socket_, message.data(), message.size(), MSG_DONTWAIT | MSG_NOSIGNAL, to,
                  sizeof address) == static_cast<ssize_t>(message.size());
}

}  // namespace baudgate::log
