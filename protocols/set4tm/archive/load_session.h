// The job that reads the load profiles of one meter. What is kept of each profile is the place up
// to which it was read (load_profile.h):
//
//   9020001 1:0658:1414080200023437:30;2:0000:1314080200023337:2
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/set4tm/archive/background_job.h"
#include "protocols/set4tm/archive/load_profile.h"
#include "protocols/set4tm/meter/settings.h"

namespace baudgate::protocols::set4tm {

class LoadSession final : public BackgroundJob {
 public:
  /// Between looks whether there is something new.
  static constexpr Duration kLook = std::chrono::minutes(5);

  explicit LoadSession(const Settings& settings);

  bool wanted() const override { return !states_.empty(); }
  void OnMeter(std::uint32_t serial) override;
  void OnType(std::optional<std::uint8_t> type) override;
  void OnFailure(Instant now) override;
  void OnReconnect() override;
  void ForgetRefusals() override;
  /// "load_1 read to 2026-11-23T10:30:00.000Z".
  std::string Shown() const override;

 private:
  struct State {
    LoadReader reader;
    Instant due{};
    bool refused = false;
    std::string kept{};  // the place that is on the disk
  };

  std::optional<Instant> NextDue() const override;
  void Recall(std::string_view said) override;
  Bytes NextPdu() override;
  Answer TakeData(View data, const Scale& scale) override;
  Answer Refused(Answer answer) override;
  void Keep(State& state, std::string_view place, bool another);
  std::string Said(const State& instead, const LoadPlace& place) const;
  LoadReader::Manner manner() const { return {most_, !tagged_}; }

  std::vector<State> states_;
  KeptMeter meter_;
  std::size_t most_ = 16;
  bool tagged_ = true;  // it knows 0C, or that is not known yet
  bool blind_ = false;  // its constants are not known
  std::uint8_t id_ = 0;
  std::size_t asked_ = 0;
};

}  // namespace baudgate::protocols::set4tm
