// MisbehavingTwin runs a line of two real devices, one of which has a fault for a minute, and
// counts how the exchanges of both devices ended.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "gateway/tools/simulate/simulator.h"
#include "gateway/tools/simulate/twin_faults.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate::protocols {

inline constexpr std::uint32_t kTroubled = 0;
inline constexpr std::uint32_t kNeighbour = 1;

class Tally {
 public:
  Tally() = default;
  Tally(const bus::DeviceStatus& before, const bus::DeviceStatus& after) {
    for (std::size_t i = 0; i < kOutcomeCount; ++i)
      counts_[i] = after.outcomes[i] - before.outcomes[i];
  }
  std::uint32_t operator[](Outcome outcome) const {
    return counts_[static_cast<std::size_t>(outcome)];
  }
  std::uint32_t all() const {
    std::uint32_t sum = 0;
    for (const std::uint32_t count : counts_) sum += count;
    return sum;
  }
  std::uint32_t failed() const { return all() - (*this)[Outcome::ok]; }

 private:
  std::array<std::uint32_t, kOutcomeCount> counts_{};
};

inline void PrintTo(const Tally& tally, std::ostream* out) {
  for (std::size_t i = 0; i < kOutcomeCount; ++i) {
    const auto outcome = static_cast<Outcome>(i);
    if (tally[outcome] > 0) *out << Name(outcome) << " " << tally[outcome] << " ";
  }
}

class MisbehavingTwin : public ::testing::TestWithParam<Setup> {
 protected:
  MisbehavingTwin() : rig_(GetParam()) {
    rig_.LearnTruth();
    rig_.Watch();
    for (std::uint32_t device = 0; device < rig_.devices(); ++device)
      rig_->twin(device).manner.fragment = 16;
  }

  void Misbehave(const std::string& text) {
    const std::string separator = text.find(':') == std::string::npos ? ":" : ",";
    const auto fault = tools::ParseFault(text + separator + "after=10s,for=1min");
    ASSERT_TRUE(fault) << fault.error();
    const tools::TwinWire wire{GetParam().serial, true, 5ms};
    faults_.emplace(std::vector{*fault}, wire, rig_->now().instant, MeetStranger());
    rig_->twin(kTroubled).manner.deliver = [this](View request, Bytes reply, Instant end) {
      if (faults_->IsDead(end)) PowerOff();
      if (!reply.empty()) LookAt(request, reply);
      return faults_->Deliver(request, std::move(reply), end);
    };
    Begin();
    rig_->RunFor(9s);
    End();
    EXPECT_EQ(own_.failed(), 0U) << ::testing::PrintToString(own_) << ": it was not time yet";
    Begin();
    rig_->RunFor(1min);
    end_state_ = rig_->StatusOf(kTroubled).state;
    rig_->RunFor(2s);
    End();
    struck_ = faults_->Counts()[0].struck;
    EXPECT_GT(struck_, 0U);
  }

  void EverythingComesBack() {
    EXPECT_TRUE(rig_->RunUntil([&] { return rig_.AllGood(); }, 3min)) << "not all points are good";
    for (std::uint32_t device = 0; device < rig_.devices(); ++device) {
      const auto online = [&] { return rig_->StatusOf(device).state == bus::DeviceState::online; };
      EXPECT_TRUE(rig_->RunUntil(online, 3min)) << "device " << device << " is not online";
    }
    rig_->RunFor(2min);
    rig_.Watch();
    Begin();
    rig_->RunFor(1min);
    End();
    EXPECT_EQ(own_.failed(), 0U) << ::testing::PrintToString(own_);
    EXPECT_EQ(neighbour_.failed(), 0U) << ::testing::PrintToString(neighbour_);
    EXPECT_EQ(faults_->Counts()[0].struck, struck_);
  }

  /// Expects that all exchanges of the device ended with one of these outcomes.
  void OnlyThese(std::initializer_list<Outcome> outcomes) {
    std::uint32_t sum = 0;
    for (const Outcome outcome : outcomes) sum += own_[outcome];
    EXPECT_EQ(sum, own_.all()) << ::testing::PrintToString(own_);
  }
  /// `failed`: the most exchanges that can collide with untimely bytes of the faulty device.
  void TheNeighbourWasServed(std::uint32_t failed = 0) {
    EXPECT_GT(neighbour_[Outcome::ok], 20U);
    EXPECT_LE(neighbour_.failed(), failed) << ::testing::PrintToString(neighbour_);
  }
  config::Timing Times() {
    return Merge(rig_.device(kTroubled).timing, GetParam().protocol->timing(GetParam().serial));
  }

  Rig rig_;
  std::optional<tools::TwinFaults> faults_;
  std::unique_ptr<Twin> stranger_;
  Tally own_;
  Tally neighbour_;
  bus::DeviceState end_state_ = bus::DeviceState::never_seen;
  std::uint64_t struck_ = 0;
  std::size_t untagged_ = 0;
  std::size_t echo_hides_ = 0;
  std::size_t zeros_harmless_ = 0;

  void Begin() {
    own_before_ = rig_->StatusOf(kTroubled);
    neighbour_before_ = rig_->StatusOf(kNeighbour);
  }
  void End() {
    own_ = Tally(own_before_, rig_->StatusOf(kTroubled));
    neighbour_ = Tally(neighbour_before_, rig_->StatusOf(kNeighbour));
  }

  tools::TwinFaults::Stranger MeetStranger() {
    const Protocol& protocol = *GetParam().protocol;
    const config::Device devices[] = {rig_.device(kTroubled), rig_.device(kNeighbour)};
    stranger_ = protocol.make_twin(rig_.device(kTroubled), rig_->twin(kNeighbour).values);
    stranger_->ReplyAs(tools::FreeAddress(protocol, devices).value());
    return [this](View request, Instant now) { return stranger_->Answer(request, now); };
  }

  void PowerOff() {
    auto& twin = rig_->twin(kTroubled);
    twin.twin = GetParam().protocol->make_twin(rig_.device(kTroubled), twin.values);
  }

  bool CarriesAddress(View request) {
    return !GetParam()
                .protocol
                ->expect(request,
                         ParseOptions(*GetParam().protocol, rig_.device(kTroubled).options))
                .address.empty();
  }

  void LookAt(View request, View reply) {
    const Protocol& protocol = *GetParam().protocol;
    const config::Options& options = rig_.device(kTroubled).options;
    if (!CarriesAddress(request)) ++untagged_;
    if (EchoHides(protocol, options, request, reply)) ++echo_hides_;
    const bool zeros = std::ranges::find(reply, 0) != reply.end();
    const Bytes zero = {0};
    if (zeros && Hear(protocol, options, request, zero).blame == Outcome::none) ++zeros_harmless_;
  }

  bus::DeviceStatus own_before_;
  bus::DeviceStatus neighbour_before_;
};

}  // namespace baudgate::protocols
