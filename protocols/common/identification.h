// Whether a device is of the type that its profile is for, by the name that it gives itself: DCON's
// `$AAM`, the F text of SPA, the identification of Modbus. Names and free texts are loose, as
// clones and variants have their own, so only a name that another profile lists contradicts.
// ProbeChoice chooses the request with which a device is looked for.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "config/model/device.h"
#include "protocols/conversation.h"

namespace baudgate::protocols {

/// `says`: the name as it came. Reason::none with a text: nobody lists the name, the values are
/// good anyway.
DeviceTrouble JudgeName(const config::Identity& identity, std::string_view says);

// Which request a device is looked for with: one that identifies it as long as it may know that,
// and reads in turn beside it. Told by the conversation what came of probes and polls.

/// A device that does not know its identification is silent to it, and so is one that is gone. So
/// after every unanswered probe it is the other's turn:
///
///     identification, silence; read 2, silence; identification, silence; read 3, answer; …
///
/// and once three identifications in a row were followed by an answered read, the device is taken
/// not to know it: then reads alone. One that has ever answered it knows it: a server that is one
/// reply behind may answer reads and not this.
class ProbeChoice {
 public:
  enum class Own {
    none,            ///< reads alone
    identification,  ///< its answer names the device, or is one that no read gives
    /// A read that no poll makes, so that its answer is known from theirs, but not from another
    /// device's. Once it has been answered nothing else is asked: the answer to a read could be a
    /// late one that a device beside it owes to a poll.
    read,
  };
  explicit ProbeChoice(Own own) : own_(own) {}

  /// The read to send, 0…reads - 1; empty: the device's own probe. `best`: the read to prefer
  /// where no turn is due.
  std::optional<std::size_t> Next(std::size_t reads, std::size_t best = 0) const;

  /// A probe was answered; `own`: the device's own.
  void OnAnswered(bool own);
  /// A probe failed. True: the device may be one that does not know its own, so that another probe
  /// is worth sending at once.
  bool OnFailed(bool own);
  /// A poll was answered.
  void OnPolled() { failed_ = 0; }
  /// It may be another device now: an identification that was given up gets one more try.
  void OnReconnect();

 private:
  bool GivenUp() const;

  Own own_;
  std::size_t failed_ = 0;       // probes since its own, or a poll, was answered
  bool own_unanswered_ = false;  // the last one of its own, and nothing was answered since
  int silences_ = 0;             // of its own in a row, each followed by an answered read
  bool own_answered_ = false;    // ever
};

}  // namespace baudgate::protocols
