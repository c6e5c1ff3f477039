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
/// trouble if another profile lists the name. If no profile lists it, the result has Reason::none
/// and a text, and the device's values stay good.
DeviceTrouble JudgeName(const config::Identity& identity, std::string_view says);

/// Chooses which request tests whether a device answers: the device's own probe (an identification)
/// or one of the reads that polls use. A device that does not support the identification is silent
/// to it, like a device that is absent. So after an unanswered probe the two kinds alternate:
///
///     identification, silence; read 2, silence; identification, silence; read 3, answer; …
///
/// If three unanswered identifications in a row were each followed by an answered read, the device
/// is assumed not to support it, and only reads are sent. This is never assumed of a device that
/// has answered its identification once: a serial server that delivers each reply one request late
/// could answer the reads and not the identification.
class ProbeChoice {
 public:
  enum class Own {
    none,            ///< the device has no probe of its own: only reads are sent
    identification,  ///< the reply names the device, so it differs from the reply to any read
    /// A read that no poll sends, so its reply differs from replies to polls, but not from replies
    /// of other devices. Once it was answered, it is the only probe: the reply to another read
    /// could be a late reply of a neighbouring device to a poll.
    read,
  };
  explicit ProbeChoice(Own own) : own_(own) {}

  /// Returns which read to send next, 0…reads - 1. Empty: send the device's own probe. `best`: the
  /// read to send once the own probe is given up.
  std::optional<std::size_t> Next(std::size_t reads, std::size_t best = 0) const;

  /// Call it when a probe was answered. `own`: the probe was the device's own probe.
  void OnAnswered(bool own);
  /// Call it when a probe has failed. Returns true if the device perhaps does not support its own
  /// probe, so that a read should be sent as the next probe at once.
  bool OnFailed(bool own);
  void OnPolled() { failed_ = 0; }
  /// Call it when another device may be connected. An identification that was given up is then
  /// tried once more.
  void OnReconnect();

 private:
  bool GivenUp() const;

  Own own_;
  // How many probes have failed since the own probe or a poll was answered.
  std::size_t failed_ = 0;
  bool own_unanswered_ = false;  // true: the last own probe failed, and no probe was answered since
  // How many own probes in a row were unanswered and followed by an answered read.
  int silences_ = 0;
  bool own_answered_ = false;
};

}  // namespace baudgate::protocols
