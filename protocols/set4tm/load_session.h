// The load profiles of one meter, read in the background: one exchange a task. Fed by the
// conversation with what is kept and with replies; it gives the next request and, with each batch
// of records, the text that tells a later start where to go on:
//
//   9020001 1:0658:1414080200023437:30;2:0000:1314080200023337:2
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/set4tm/background_job.h"
#include "protocols/set4tm/load_reader.h"
#include "protocols/set4tm/settings.h"

namespace baudgate::protocols::set4tm {

class LoadSession final : public BackgroundJob {
 public:
  /// Between looks whether there is something new.
  static constexpr Duration kLook = std::chrono::minutes(5);
  static constexpr Duration kRest = std::chrono::seconds(30);

  explicit LoadSession(const Settings& settings);

  bool wanted() const override { return !states_.empty(); }
  std::optional<Instant> due() const override;
  void OnKept(std::string_view said) override;
  void OnMeter(std::uint32_t serial) override;
  void OnType(std::optional<std::uint8_t> type) override;
  Bytes Next(Instant now) override;
  Answer OnData(View data, const Scale& scale, Instant now) override;
  Answer OnRefused(Answer answer, Instant now) override;
  void OnFailure(Instant now) override;
  void OnReconnect() override;
  /// "load_1 read to 2026-11-23T10:30:00.000Z".
  std::string Shown() const override;

 private:
  struct State {
    LoadReader reader;
    Instant due{};
    bool refused = false;
    std::string kept{};  // the place that is on the disk
  };

  void Keep(State& state, std::string_view place, bool another);
  std::string Said(const State& instead, const LoadPlace& place) const;
  LoadReader::Manner manner() const { return {most_, !tagged_}; }

  std::vector<State> states_;
  bool recalled_ = false;
  std::optional<std::uint32_t> meter_;       // that answers
  std::optional<std::uint32_t> told_meter_;  // whose places are kept
  std::size_t most_ = 16;
  bool tagged_ = true;  // it knows 0C, or that is not known yet
  bool blind_ = false;  // its constants are not known
  std::uint8_t id_ = 0;
  std::size_t asked_ = 0;
  Instant latest_{};  // exchange
};

}  // namespace baudgate::protocols::set4tm
