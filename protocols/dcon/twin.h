// A DCON module that is not there: answers requests as the real one does, from the points of its
// profile. Requests come from gateway/tools/simulate/simulator.h, replies go back to it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "protocols/common/twin_points.h"
#include "protocols/dcon/points.h"
#include "protocols/dcon/settings.h"
#include "protocols/twin.h"

namespace baudgate::protocols::dcon {

/// It takes samples (`#**`), and its host watchdog runs once it is set (`~AA3EVV`).
/// Where each input has a type of its own (option channel_types), `$AA7CiRrr` sets it as at a real
/// module.
class DconTwin : public Twin {
 public:
  /// Both outlive the twin.
  DconTwin(const config::Device& device, TwinValues& values);

  Bytes Answer(View request, Instant now) override;
  void ReplyAs(std::string_view address) override;

 private:
  using Known = TwinPoints<ReadAddress, WriteAddress>::One;

  std::optional<std::string> AnswerRead(const std::string& command, Instant now) const;
  std::optional<std::string> AnswerChannel(const std::string& command, Instant now) const;
  std::optional<std::string> AnswerIdentity(const std::string& command) const;
  std::optional<std::string> AnswerChannelType(const std::string& command);
  bool Counts() const;
  void Clear(const std::string& command);
  std::string Configuration(std::string told) const;
  std::string ConfiguredText(Instant now) const;
  std::optional<std::string> AnswerWrite(const std::string& command);
  std::optional<std::string> AnswerGroup(const std::string& command);
  std::optional<std::string> AnswerWatchdog(const std::string& command, Instant now);
  void TakeSample(Instant now);
  std::optional<std::string> AnswerSample(const std::string& command);
  std::string Joined(Form form, const std::string& command, Instant now) const;
  std::uint64_t Word(const std::string& command, Form form, Instant now) const;
  std::size_t Channels(const std::string& command) const;
  const Known* Find(std::string_view command) const;
  const Known* FindChannel(std::string_view command, std::size_t channel) const;

  Settings settings_;
  std::uint8_t address_;
  std::string who_;  ///< the address as it stands in replies
  TwinPoints<ReadAddress, WriteAddress> points_;
  std::map<unsigned, std::uint8_t> types_;  ///< of inputs
  bool restarted_ = true;                   ///< since `$AA5` was asked
  Duration watchdog_{};                     ///< zero: off
  Instant host_heard_at_{};
  bool tripped_ = false;
  std::string sample_;    ///< as `$AA4` tells it; empty: none was taken
  bool fetched_ = false;  ///< it was told
};

}  // namespace baudgate::protocols::dcon
