// Text of another process as whole lines that may go into our log: printable, cut, and not more
// than a log can bear. Bytes come from its standard error.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/time.h"

namespace baudgate::dds {

class BoundedLines {
 public:
  static constexpr std::size_t kLongest = 500;  ///< bytes; the rest of a longer line is left out
  static constexpr std::size_t kMost = 20;  ///< lines in kPeriod; of the others the number is told
  static constexpr Duration kPeriod = 10s;

  /// The lines that are complete now.
  std::vector<std::string> Add(std::string_view bytes, Instant now);

 private:
  void Finish(Instant now, std::vector<std::string>& lines);

  std::string line_;
  Instant period_end_{};
  std::size_t told_ = 0;
  std::size_t left_out_ = 0;
};

}  // namespace baudgate::dds
