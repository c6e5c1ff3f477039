// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/secret_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>

#include "gateway/base/text.h"
#include "gateway/base/trusted_file.h"

namespace baudgate {
namespace {

constexpr std::size_t kLongest = 256;

class OpenFile {
 public:
  /// Opens a file. With O_NONBLOCK, opening a pipe does not wait for its writer.
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

Result<std::string> ReadSecretFile(const std::string& what, const std::string& file,
                                   bool by_group) {
  const std::string name = what + " " + file;
  const OpenFile open(file);
  if (open.get() < 0) return Error{name + " cannot be read: " + std::strerror(errno)};
  if (const std::string why = WhyNotTrusted(file); !why.empty()) {
    return Error{what + " is not used: " + why};
  }
  struct stat status {};
  if (::fstat(open.get(), &status) != 0 || !S_ISREG(status.st_mode)) {
    return Error{name + " is not a regular file"};
  }
  const mode_t others = by_group ? S_IRWXO : S_IRWXG | S_IRWXO;
  if ((status.st_mode & others) != 0) {
    return Error{name + " can be read by other users than its owner; run: chmod 0600 " + file};
  }
  std::array<char, kLongest + 2> bytes{};
  const ssize_t got = ::read(open.get(), bytes.data(), bytes.size());
  if (got < 0) return Error{name + " cannot be read: " + std::strerror(errno)};
  const std::string_view text(bytes.data(), static_cast<std::size_t>(got));
  std::string secret(Trim(text.substr(0, text.find('\n'))));
  if (secret.empty() || secret.size() > kLongest) {
    return Error{name + " has no first line of 1 to " + std::to_string(kLongest) + " characters"};
  }
  return secret;
}

}  // namespace baudgate
