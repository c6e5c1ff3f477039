// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/token_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::web {
namespace {

class OpenFile {
 public:
  /// Does not wait for the writer of a pipe.
  explicit OpenFile(const std::string& file)
      : descriptor_(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {}
  ~OpenFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  int get() const { return descriptor_; }

 private:
  const int descriptor_;
};

}  // namespace

Result<std::string> ReadToken(const std::string& file) {
  const std::string name = "the token file " + file;
  const OpenFile open(file);
  if (open.get() < 0) {
    return Error{name + " cannot be read: " + std::strerror(errno) +
                 "; make it with: install -m 0600 -o baudgate /dev/null " + file +
                 " && openssl rand -hex 32 > " + file};
  }
  struct stat status {};
  if (::fstat(open.get(), &status) != 0 || !S_ISREG(status.st_mode)) {
    return Error{name + " is no regular file"};
  }
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    return Error{name + " can be read by others than its owner; write: chmod 0600 " + file};
  }
  std::array<char, kLongestToken + 2> bytes{};
  const ssize_t got = ::read(open.get(), bytes.data(), bytes.size());
  if (got < 0) return Error{name + " cannot be read: " + std::strerror(errno)};
  const std::string_view text(bytes.data(), static_cast<std::size_t>(got));
  const std::string token(Trim(text.substr(0, text.find('\n'))));
  if (token.size() < kShortestToken || token.size() > kLongestToken) {
    return Error{name + " has a token of " + std::to_string(token.size()) +
                 " characters; its first line needs " + std::to_string(kShortestToken) + " to " +
                 std::to_string(kLongestToken) + ", as openssl rand -hex 32 makes them"};
  }
  const auto fits = [](char c) { return c > 0x20 && c < 0x7F; };
  if (!std::ranges::all_of(token, fits)) {
    return Error{name + " has a token with spaces or other characters that no header can carry"};
  }
  return token;
}

}  // namespace baudgate::web
