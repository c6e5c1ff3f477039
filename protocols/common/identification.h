// Checks the name that a device reports (DCON's `$AAM`, the F text of SPA, the identification of
// Modbus) against its profile. Clones and variants report names of their own, so only a name that
// another profile lists is a contradiction. ProbeChoice chooses the request that tests whether a
// device answers.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "config/model/device.h"
#include "protocols/conversation.h"

namespace baudgate::protocols {

/// Compares `says`, the name that the device has reported, with the names of its profile. Returns a
/// trouble if another profile lists the name. If no profile lists the name, the result has
/// Reason::none and a text, and the device's values stay good.
DeviceTrouble JudgeName(const config::Identity& identity, std::string_view says);

/// Chooses which request tests whether a device answers: the device's own probe (an identification)
/// or one of the reads that polls use. A device that does not support the identification does not
/// answer it, like an absent device. So after an unanswered probe the two kinds of request
/// alternate:
///
///     identification, silence; read 2, silence; identification, silence; read 3, answer; …
///
/// If three unanswered identifications in a row were each followed by an answered read, the device
/// is assumed not to support identification, and only reads are sent. This is never assumed of a
/// device that has answered its identification once: behind a serial server that delivers each
/// reply one request late, it would seem to answer only the reads.
class ProbeChoice {
 public:
  enum class Own {
    none,
    identification,  ///< the reply names the device, so it differs from the reply to any read
    /// A read that no poll sends, so its reply differs from the replies to polls, but not from
    /// replies of other devices. After it was answered once, no other read is used as a probe: the
    /// reply to such a read could be a late reply of a neighbouring device to a poll.
    read,
  };
  explicit ProbeChoice(Own own) : own_(own) {}

  /// Returns the index of the read to send as the next probe, 0…reads - 1. Empty: send the device's
  /// own probe. `best`: the read to prefer if the device does not support its own probe.
  std::optional<std::size_t> Next(std::size_t reads, std::size_t best = 0) const;

  /// Call it when a probe was answered. `own`: the answered probe was the device's own probe.
  void OnAnswered(bool own);
  /// Call it when a probe has failed. Returns true if a read should be sent as the next probe at
  /// once, because the device perhaps does not support its own probe.
  bool OnFailed(bool own);
  void OnPolled() { failed_ = 0; }
  /// Call it when another device may be connected. If own probes are no longer sent, one is sent
  /// again.
  void OnReconnect();

 private:
  bool GivenUp() const;

  Own own_;
  // How many probes have failed since the last answer that resets the count, see OnAnswered and
  // OnPolled.
  std::size_t failed_ = 0;
  // True: the last own probe failed, and no probe was answered since then.
  bool own_unanswered_ = false;
  // How many own probes in a row were unanswered and followed by an answered read.
  int silences_ = 0;
  bool own_answered_ = false;
};

}  // namespace baudgate::protocols
