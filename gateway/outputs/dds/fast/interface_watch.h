// Notices that an interface was deleted and made again or has come up, or that an address has come:
// the library has joined its multicast groups on the old ones, and sends nothing on the new ones.
// When an address is gone, the library reaches no new subscriber on the others either (measured).
// Pure: addresses come in, see gateway/outputs/dds/fast/own_addresses.h.
//
//   at the start 10.0.0.5 at 2     later 10.0.0.5 at 2    nothing
//                                  later down             nothing: others are still reached
//                                  later gone, others up  the participant must be made again
//                                  later gone, alone      nothing: there is nobody to reach
//                                  later 10.0.0.5 at 7    the participant must be made again
//   at the start 10.0.0.5 down     later 10.0.0.5 at 2    the same
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gateway/outputs/dds/fast/own_addresses.h"

namespace baudgate::dds {

class InterfaceWatch {
 public:
  /// `interfaces`: as in ParticipantOptions. `own`: when the participant was made.
  InterfaceWatch(std::vector<std::string> interfaces, OwnAddresses own)
      : interfaces_(std::move(interfaces)), own_(std::move(own)) {}

  /// Why the participant must be made again; empty: it need not.
  std::optional<std::string> Look(const OwnAddresses& now) const;

 private:
  bool Uses(const std::string& address) const;
  /// An address that was up and that the machine no longer has, while it has another one.
  std::optional<std::string> Gone(const OwnAddresses& now) const;

  const std::vector<std::string> interfaces_;
  const OwnAddresses own_;
};

}  // namespace baudgate::dds
