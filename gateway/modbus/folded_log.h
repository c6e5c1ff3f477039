// Log lines about clients, folded: the first of a kind at once, its repeats as one sum a minute, so
// that a hostile client can not fill the disk. Lines go to the spdlog default logger.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "gateway/base/time.h"

namespace baudgate::modbus {

class FoldedLog {
 public:
  enum class Kind : std::uint8_t { refused, malformed, stalled, accept_failed };

  void Note(Kind kind, Instant now, std::string_view peer, std::string_view what);
  /// Writes the sums that are due. Call it now and then.
  void Sweep(Instant now);

 private:
  struct Fold {
    Instant until = Instant::min();
    std::uint64_t repeats = 0;
  };
  std::array<Fold, 4> folds_;
};

}  // namespace baudgate::modbus
