// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/open_files.h"

#include <sys/resource.h>

namespace baudgate {

OpenFiles::OpenFiles() {
  const MutexLock lock(mutex_);
  folder_.reset(::opendir("/proc/self/fd"));
}

OpenFiles::Count OpenFiles::Now() {
  Count count;
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
    count.limit = limit.rlim_cur;
  }
  const MutexLock lock(mutex_);
  if (!folder_) return count;
  ::rewinddir(folder_.get());
  while (const dirent* const one = ::readdir(folder_.get())) {
    if (one->d_name[0] != '.') ++count.open;
  }
  return count;
}

}  // namespace baudgate
