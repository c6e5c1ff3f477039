// A tar.gz in memory: POSIX ustar, packed by zlib.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate {

class Archive {
 public:
  /// `folder`: in front of every name; `at`: the time of every file.
  Archive(std::string folder, WallTime at);

  /// A file that its owner may read and write. Characters of `name` other than letters, digits,
  /// '.',
  /// '-', '_' and '/' become '_', and what is longer than 90 is cut.
  void Add(std::string_view name, std::string_view content);
  /// All of it, packed.
  Result<std::string> Packed() const;

 private:
  const std::string folder_;
  const WallTime at_;
  std::string tar_;
};

}  // namespace baudgate
