// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dirent.h>

#include <cstddef>
#include <memory>

#include "gateway/base/guarded.h"

namespace baudgate {

/// Counts the files that this process has open, also at its limit. From any thread.
class OpenFiles {
 public:
  OpenFiles();

  struct Count {
    std::size_t open = 0;
    std::size_t limit = 0;  ///< 0: there is none, or it is not known
  };
  Count Now();

 private:
  struct Closer {
    void operator()(DIR* folder) const { ::closedir(folder); }
  };
  Mutex mutex_;
  std::unique_ptr<DIR, Closer> folder_ BAUDGATE_GUARDED_BY(mutex_);  // null: it cannot be read
};

}  // namespace baudgate
