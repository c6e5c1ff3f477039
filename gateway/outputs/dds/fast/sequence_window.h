// How far each writer has counted, as far as it has told: the DDS library counts every number that
// is skipped one by one, so a jump has a price. Pure and of fixed size;
// gateway/outputs/dds/fast/datagram_check.h asks it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/rtps/rtps_fields.h"

namespace baudgate::dds {

struct WindowLimits {
  /// Numbers that all writers of discovery may skip together at once, and how many each second
  /// after that. A participant of Cyclone DDS that runs for years has told of its liveliness some
  /// million times.
  std::int64_t burst = 1 << 24;
  std::int64_t each_second = 1 << 22;
  /// What a writer of samples may begin with when it is first heard of.
  std::int64_t first_of_samples = std::int64_t{1} << 32;
};

class SequenceWindow {
 public:
  explicit SequenceWindow(const WindowLimits& limits);

  /// The writer tells of numbers up to `to`, at least 0, and of `skipped` ones that no reader gets.
  /// False: counting to there would take too long.
  bool Advance(const Guid& writer, std::int64_t to, std::int64_t skipped, Instant now);

 private:
  struct Writer {
    Guid guid{};
    std::int64_t told = 0;
    Instant heard{};
  };

  Writer& Find(const Guid& guid);
  bool Pay(std::int64_t steps, Instant now);

  WindowLimits limits_;
  std::vector<Writer> writers_;
  std::int64_t purse_;
  Instant filled_{};
};

}  // namespace baudgate::dds
