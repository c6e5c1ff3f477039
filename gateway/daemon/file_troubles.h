// Small files that cannot be written, for the log and the status, as long as it lasts.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "gateway/base/guarded.h"

namespace baudgate {

/// From any thread.
class FileTroubles {
 public:
  /// For the writer of `file`: call it with what is wrong now, or with an empty text when the file
  /// can be written again. It may outlive this object.
  std::function<void(const std::string& trouble)> Reporter(const std::string& file);
  std::vector<std::string> all() const { return held_->All(); }

 private:
  struct Held {
    std::vector<std::string> All() const;
    /// Returns the trouble that was set before.
    std::string Set(const std::string& file, const std::string& trouble);

    mutable Mutex mutex;
    std::map<std::string, std::string> troubles BAUDGATE_GUARDED_BY(mutex);
  };
  const std::shared_ptr<Held> held_ = std::make_shared<Held>();
};

}  // namespace baudgate
