// What a meter's conversation keeps over restarts of the program: which meter it was, and how often
// the password was refused, for a meter blocks it for the day after three wrong ones
// (set-4tm protocol, 2.3). One line of text:
//
//   serial 12345678; password 5A refused 1790000000 1790003600      (the last in Unix seconds)
//
// 5A changes with the password, so that another one is tried again, and does not tell it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"

namespace baudgate::protocols::set4tm {

class MeterMemory {
 public:
  /// From the first refusal to the one try more.
  static constexpr Duration kSecondTry = 1h;
  static constexpr std::size_t kMostTries = 2;

  explicit MeterMemory(View password);

  /// What text() said before the restart; empty: this is the first start.
  void Recall(std::string_view text, Now now);
  const std::string& text() const { return text_; }
  /// Recall was called: what is learned here has somewhere to stay.
  bool is_kept() const { return clock_.has_value(); }

  /// The meter that answered first; empty: none has said its number yet.
  std::optional<std::uint32_t> serial() const { return serial_; }
  void OnSerial(std::uint32_t serial);
  /// A person has accepted what is there: the next meter that answers is the right one, and the
  /// password is tried again.
  void OnEnabled();

  /// The password may be tried.
  bool MayTry(Instant now) const;
  void OnRefused(Instant now);
  void OnAccepted();
  /// It is not tried any more before OnEnabled.
  bool given_up() const { return refused_.size() >= kMostTries; }
  /// Until it may be tried again; of one that is given up, how long to leave the meter in peace.
  Duration Wait(Instant now) const;

 private:
  void Write();

  const std::uint8_t mark_;  // of the password
  std::optional<std::uint32_t> serial_;
  std::vector<Instant> refused_;  // when, at most kMostTries
  std::optional<Now> clock_;      // empty: civil time is not known, nothing is kept
  std::string text_;
};

}  // namespace baudgate::protocols::set4tm
