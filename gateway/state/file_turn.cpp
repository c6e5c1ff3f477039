// SPDX-License-Identifier: Apache-2.0
#include "gateway/state/file_turn.h"

namespace baudgate {

void FileTurn::Take() {
  MutexLock lock(mutex_);
  const std::uint64_t own = next_++;
  while (own != serving_) lock.Wait(changed_);
}

void FileTurn::Give() {
  {
    const MutexLock lock(mutex_);
    ++serving_;
  }
  changed_.notify_all();
}

}  // namespace baudgate
