// What goes to all modules of a line at once and is answered by none: `~**`, the host is there, and
// `#**`, take a sample now. When each is due; conversations (conversation.h) send them in front of
// their own requests. Source: dcon reference, 12 and 14.
//
//   > #**                        every module samples
//   > $014   < >011+05.880       1: fetched for the first time, so it is the sample of this #**
//   > $024   < !12A1500
//   > #**                        module 01 is asked again
//
// A module that has not heard the last `#**` still holds the sample before; its digit is 0 when
// that was fetched. So a sample counts only when the one before it is known to have been fetched.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "gateway/base/time.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::dcon {

inline constexpr const char* kHostIsThere = "~**";
inline constexpr const char* kTakeSample = "#**";
inline constexpr const char* kAskSample = "$4";

/// A module hears what comes in its own checksum mode: two groups share a line at most.
class DconBus : public Bus {
 public:
  struct Group {
    std::optional<Instant> told_at;     ///< `~**` was sent
    std::uint64_t samples = 0;          ///< so many `#**` were
    std::optional<Instant> sampled_at;  ///< the latest of them
  };
  Group& Of(bool checksum) { return groups_[checksum ? 1 : 0]; }

 private:
  std::array<Group, 2> groups_;
};

/// One module's part in the samples of its line.
class Sampling {
 public:
  /// `group` outlives it. `period`: of its polls; an older sample is not fetched.
  Sampling(DconBus::Group& group, Duration period) : group_(group), period_(period) {}

  /// `#**` is to be sent before `$AA4`: it has been asked for the latest sample, or that is old.
  bool WantsNew(Instant now) const;
  void OnSampled(Instant now);
  /// `$AA4` was answered, or has failed.
  void OnAsked() { asked_ = group_.samples; }
  /// It was answered. `first`: what the module says of this fetch. Empty: it is the sample that
  /// was asked for; else why its value does not count.
  std::optional<std::string> WhyNot(bool first);
  /// Another module may answer now.
  void OnReconnect() { fetched_.reset(); }

  /// Samples of others go on between its own polls.
  bool IsOvertaken() const { return overtaken_ >= kOftenOvertaken; }

 private:
  static constexpr int kOftenOvertaken = 3;

  DconBus::Group& group_;
  Duration period_;
  std::uint64_t asked_ = 0;
  std::optional<std::uint64_t> fetched_;  ///< the latest when it answered last
  int overtaken_ = 0;                     ///< in a row
};

}  // namespace baudgate::protocols::dcon
