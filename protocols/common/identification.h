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

/// Judges `says`, the name as received. Reason::none with a text: no profile lists the name; the
/// values stay good.
DeviceTrouble JudgeName(const config::Identity& identity, std::string_view says);

/// Chooses between the device's own probe, an identification, and reads. A device that does not
/// support the identification is silent to it, like a device that is absent. So after an unanswered
/// probe the kind of probe alternates:
///
///     identification, silence; read 2, silence; identification, silence; read 3, answer; …
///
/// If three unanswered identifications in a row were each followed by an answered read, the device
/// is assumed not to support it, and only reads are sent. A device that has answered its
/// identification once is never assumed so: a serial server that delivers each reply one request
/// late could answer the reads and not the identification.
/// The conversation reports the results of probes and polls.
class ProbeChoice {
 public:
  enum class Own {
    none,            ///< there is no own probe: reads only
    identification,  ///< the answer names the device, or no read gives such an answer
    /// A read that no poll makes, so its answer differs from those to polls, but not from other
    /// devices' answers. After its first answer it is the only probe: an answer to another read
    /// could be a late reply of a neighbouring device to a poll.
    read,
  };
  explicit ProbeChoice(Own own) : own_(own) {}

  /// Returns the read to send, 0…reads - 1; empty: send the device's own probe. `best`: the read to
  /// send when reads are not taken in turn.
  std::optional<std::size_t> Next(std::size_t reads, std::size_t best = 0) const;

  /// Called when a probe was answered; `own`: it was the device's own probe.
  void OnAnswered(bool own);
  /// Called when a probe failed. True: the device may not support its own probe, so another probe
  /// should follow at once.
  bool OnFailed(bool own);
  void OnPolled() { failed_ = 0; }
  /// Called when another device may be connected: an identification that was given up gets one more
  /// try.
  void OnReconnect();

 private:
  bool GivenUp() const;

  Own own_;
  std::size_t failed_ = 0;       // probes that failed since the own probe or a poll was answered
  bool own_unanswered_ = false;  // the last own probe failed, and nothing was answered since
  int silences_ = 0;           // unanswered own probes in a row, each followed by an answered read
  bool own_answered_ = false;  // the own probe was answered at least once
};

}  // namespace baudgate::protocols
