// Which module answers at the address, found out before it is polled: name, type code, data format
// and checksum mode, asked with the only two commands that no module takes for a write in either
// mode. Questions go through conversation.h to the line. Source: dcon reference, 4.1 "Hazards".
//
//   checksum: true   > $01MD2 (silence)  > $012B7 (silence)  > $01M  < !017017
//                    its checksum is off
//
// Polls of such a module would write: `@01` + `A1` is "set outputs to A1" where no checksum is due.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "protocols/conversation.h"
#include "protocols/dcon/channel_types.h"
#include "protocols/dcon/decode.h"
#include "protocols/dcon/settings.h"

namespace baudgate::protocols::dcon {

inline constexpr const char* kAskName = "$M";
inline constexpr const char* kAskType = "$2";
inline constexpr const char* kAskMask = "$6";

class Identification {
 public:
  /// Both outlive it.
  Identification(const config::Device& device, const Settings& settings);

  struct Question {
    std::string_view command;
    bool other_mode = false;  ///< with a checksum where the configuration has none, or without one

    bool operator==(const Question&) const = default;
  };

  /// What to ask before `command` (without address) may go out; empty: no question is left.
  std::optional<Question> Next(std::string_view command);
  /// What it is time to ask again behind `command`.
  std::optional<Question> NextAnew(std::string_view command, Instant now);
  /// No question of the round is left.
  bool is_done() const { return done_; }
  /// Whether the command may go out now: only after the round of questions, and if nothing wrong
  /// was found. If the module did not answer them: harmless commands always, others only with
  /// `checksum: false`, because a module whose checksum is on ignores them. The exception,
  /// IsTakenCutShort, is for the caller to check.
  bool Allows(std::string_view command) const;
  /// Whether a module whose checksum is on would take the last two characters of this request for
  /// the checksum, and it is not known that the module's is off. Example: `#01+03.070` ends
  /// with the right checksum of `#01+03.0`, which sets another value.
  bool IsTakenCutShort(View request) const;
  /// The module was silent to a whole round, so that writes are not sent. If something harmless is
  /// read, that shows its mode.
  bool IsMute() const;
  /// Whether the module would take the command for a read in whichever mode it is.
  static bool IsHarmless(std::string_view command);

  /// `reply` answers the question, whatever it says.
  void OnAnswer(const Question& question, const DecodedReply& reply);
  /// Nothing came that answers it. `strange`: but something did, which may answer another request;
  /// so the module speaks in this mode.
  void OnNothing(const Question& question, bool strange);
  /// A poll was not answered, with all its repetitions: another module may answer the next.
  void OnLost();
  /// The module has answered in the configured mode.
  void OnPolled();
  /// Another module may answer now. What is wrong stays wrong until it is known to be right.
  void OnReconnect();
  /// Another count of channels came than should.
  void AskMaskAgain() { asked_mask_ = false; }

  const DeviceTrouble& trouble() const { return trouble_; }
  /// What the number of an input point is multiplied with to be one in its unit. Empty: the
  /// point's channel measures something else.
  std::optional<double> FactorOf(std::size_t point) const;
  /// The channels that are enabled in the module, bit 0 = channel 0; empty: it has not said.
  std::optional<std::uint32_t> mask() const { return mask_; }

 private:
  void Begin();
  void Advance(const Question& question);
  DeviceTrouble Judge(std::string_view configuration);
  void Sum();
  bool WantsMask() const;

  const config::Device& device_;
  const Settings& settings_;
  bool joined_ = false;      ///< `#` is polled: which channel a number is of follows from its place
  bool only_others_ = true;  ///< nothing that its points read with is harmless
  bool sure_ = false;        ///< of the checksum mode

  // The round of questions: under way, or done since OnReconnect.
  bool done_ = false;
  bool answered_ = false;
  int step_ = 0;
  bool asked_mask_ = false;

  std::optional<std::uint8_t> type_;
  std::optional<std::uint32_t> mask_;
  DeviceTrouble mode_;  ///< what the checksum mode has shown
  DeviceTrouble kind_;  ///< what type and format byte have
  DeviceTrouble name_;
  ChannelTypes channels_;
  DeviceTrouble trouble_;  ///< the worst of these, or what is remarkable
};

}  // namespace baudgate::protocols::dcon
