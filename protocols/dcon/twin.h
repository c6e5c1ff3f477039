// DconTwin simulates a DCON module for gateway/tools/simulate/simulator.h. It answers requests as a
// real module does, from the points of its profile.
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

/// The simulated device takes samples (`#**`), and its host watchdog starts when it is set
/// (`~AA3EVV`). With the option channel_types, `$AA7CiRrr` sets the type of an input, as on a real
/// module.
class DconTwin : public Twin {
 public:
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
  std::string who_;
  TwinPoints<ReadAddress, WriteAddress> points_;
  std::map<unsigned, std::uint8_t> types_;
  bool restarted_ = true;  ///< true: the module was restarted since the last `$AA5`
  Duration watchdog_{};    ///< period of the host watchdog; zero: off
  Instant host_heard_at_{};
  bool tripped_ = false;
  /// Data of the next reply to `$AA4` (fetch the sample); empty: no sample was taken.
  std::string sample_;
  bool fetched_ = false;
};

}  // namespace baudgate::protocols::dcon
