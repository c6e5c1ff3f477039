// Writes samples at a pace that loses none on the way, rests when the receiver has no room, and
// counts what was taken and refused. Time is an argument.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "gateway/base/log.h"
#include "gateway/base/time.h"
#include "gateway/outputs/dds/pacer.h"
#include "gateway/outputs/dds/sample_writer.h"

namespace baudgate::dds {

class PacedWriter {
 public:
  /// One line for people, at a change only, without the name of the output.
  using Log = std::function<void(log::Level level, const std::string& line)>;

  static constexpr Duration kLongestHold = 10ms;

  /// `writer` outlives this.
  PacedWriter(SampleWriter& writer, Log log);

  /// The next sample may be written now.
  bool MayWrite(Instant now) { return now >= held_until_ && pacer_.Take(now); }
  /// After MayWrite. `later`: write the sample again after a pause of 1, 2, 4, 8, 10, 10 … ms.
  template <typename Sample>
  Sent Write(const Sample& sample, Instant now) {
    const Sent sent = writer_.Write(sample);
    if constexpr (requires { sample.device; }) {
      Note(sent, "device ", sample.device, now);
    } else {
      Note(sent, "gateway ", sample.gateway, now);
    }
    return sent;
  }

  bool EventsAreRead() const { return writer_.subscribers().events > 0; }
  Instant ReadyAt() const { return std::max(held_until_, pacer_.ReadyAt()); }
  /// There is a new receiver.
  void ForgetHold() { held_until_ = {}; }

  // From any thread.
  std::uint64_t written() const { return written_; }
  std::uint64_t failed() const { return failed_; }

 private:
  void Note(Sent sent, std::string_view whose, const std::string& name, Instant now);

  SampleWriter& writer_;
  const Log log_;
  Pacer pacer_;
  Instant held_until_{};
  Duration hold_{};            ///< doubles while there is no room
  std::uint64_t failing_ = 0;  ///< failures since the last success; the edge is logged
  std::atomic<std::uint64_t> written_ = 0;
  std::atomic<std::uint64_t> failed_ = 0;
};

}  // namespace baudgate::dds
