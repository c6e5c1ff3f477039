// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/system_trouble.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace baudgate {

std::string SystemTrouble(int error) {
  switch (error) {
    case EMFILE:
    case ENFILE:
      return "too many open files; raise LimitNOFILE of the service (ulimit -Hn)";
    case EFBIG:
      return "a file may have no more bytes; raise LimitFSIZE of the service (ulimit -f)";
    case ENOSPC:
    case EDQUOT:
      return "the disk is full; make room on it";
    case EROFS:
      return "its file system is mounted read-only; look at the disk (dmesg)";
    case EIO:
      return "the disk fails; look at the disk (dmesg)";
    default:
      return std::generic_category().message(error);
  }
}

bool NoFileLeft() {
  const int file = ::open("/", O_RDONLY | O_PATH | O_CLOEXEC);
  if (file >= 0) ::close(file);
  return file < 0 && (errno == EMFILE || errno == ENFILE);
}

std::optional<std::size_t> MostFileBytes() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) {
    return std::nullopt;
  }
  return limit.rlim_cur;
}

}  // namespace baudgate
