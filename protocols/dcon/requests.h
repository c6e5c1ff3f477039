// The requests of one module as frames: its own commands, broadcasts, and the questions of its
// identification, which go out in either checksum mode.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

#include "protocols/conversation.h"
#include "protocols/dcon/identification.h"
#include "protocols/dcon/settings.h"

namespace baudgate::protocols::dcon {

class Requests {
 public:
  /// `settings` outlive it.
  Requests(std::uint8_t address, const Settings& settings);

  Request Own(std::string_view command) const;
  Request Broadcast(std::string_view text) const;
  Request Question(const Identification::Question& question) const;
  /// Whether the request is a question in the other checksum mode.
  bool IsInOtherMode(View request) const;
  /// The settings with which the reply to the request is read.
  const Settings& SettingsFor(View request) const {
    return IsInOtherMode(request) ? other_mode_ : settings_;
  }

 private:
  const std::uint8_t address_;
  const Settings& settings_;
  Settings other_mode_;  ///< the same with the checksum the other way
};

}  // namespace baudgate::protocols::dcon
