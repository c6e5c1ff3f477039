// Tests of requests over a real port: whole, in pieces, byte by byte, or cut off.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/simulator.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <asio/io_context.hpp>
#include <asio/post.hpp>
#include <memory>
#include <string>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate::tools {
namespace {

constexpr Duration kPatience = 20s;
constexpr std::size_t kMostRequests = 8;

std::vector<std::string> RequestsOf(const protocols::Setup& setup) {
  protocols::Rig rig(setup);
  rig.LearnTruth();
  std::vector<std::string> requests;
  for (const auto& sent : rig->sent) {
    const std::string& bytes = sent.text;
    if (std::find(requests.begin(), requests.end(), bytes) != requests.end()) continue;
    requests.push_back(bytes);
    if (requests.size() == kMostRequests) break;
  }
  return requests;
}

class SimulatorTest : public ::testing::Test {
 protected:
  ~SimulatorTest() override { Leave(); }

  void Leave() {
    if (slave_ >= 0) close(slave_);
    slave_ = -1;
    simulator_.reset();
  }

  void Inhabit(const protocols::Setup& setup, const SimulatorOptions& options = {}) {
    Leave();
    auto simulator = Simulator::Create(io_, *setup.protocol, LineOf(setup).devices, options);
    ASSERT_TRUE(simulator) << simulator.error();
    simulator_ = std::move(*simulator);
    slave_ = open(simulator_->path().c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    ASSERT_GE(slave_, 0);
  }

  /// A character takes ten seconds, so silence never ends a request.
  void InhabitWithoutSilence(const protocols::Setup& setup) {
    SimulatorOptions options;
    options.pace = setup.serial;
    options.pace->baud = 1;
    Inhabit(setup, options);
  }

  void Write(std::string_view bytes) {
    ASSERT_EQ(write(slave_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }

  bool IsAnswered(std::uint64_t before) {
    const Instant limit = std::chrono::steady_clock::now() + kPatience;
    while (simulator_->answered() == before && std::chrono::steady_clock::now() < limit) {
      io_.run_for(1ms);
    }
    return simulator_->answered() == before + 1;
  }

  asio::io_context io_{1};
  std::unique_ptr<Simulator> simulator_;
  int slave_ = -1;
};

class RealSimulatorTest : public SimulatorTest,
                          public ::testing::WithParamInterface<protocols::Setup> {};

TEST_P(RealSimulatorTest, RequestsInPiecesAreAnswered) {
  for (const std::string& request : RequestsOf(GetParam())) {
    for (const std::size_t piece : {request.size(), request.size() / 2, std::size_t{1}}) {
      InhabitWithoutSilence(GetParam());
      const std::uint64_t before = simulator_->answered();
      for (std::size_t at = 0; at < request.size(); at += piece) {
        Write(std::string_view(request).substr(at, piece));
        io_.run_for(1ms);
      }
      EXPECT_TRUE(IsAnswered(before)) << ToHex(ToBytes(request)) << " in pieces of " << piece;
    }
  }
}

TEST_P(RealSimulatorTest, MayEndWhileAReplyIsDue) {
  SimulatorOptions options;
  options.think_time = 0ms;
  Inhabit(GetParam(), options);
  Write(RequestsOf(GetParam()).front());
  const Instant limit = std::chrono::steady_clock::now() + kPatience;
  while (simulator_->answered() == 0) {
    ASSERT_LT(std::chrono::steady_clock::now(), limit);
    io_.run_one_for(1ms);
  }
  asio::post(io_, [this] { simulator_.reset(); });
  io_.run_for(10ms);
  std::uint8_t byte = 0;
  EXPECT_LE(read(slave_, &byte, 1), 0) << "the twin has answered after its end";
}

TEST_P(RealSimulatorTest, AnIncompleteRequestIsForgotten) {
  Inhabit(GetParam());
  for (const std::string& request : RequestsOf(GetParam())) {
    const std::uint64_t before = simulator_->answered();
    Write(std::string_view(request).substr(0, request.size() / 2));
    io_.run_for(100ms);
    Write(request);
    EXPECT_TRUE(IsAnswered(before)) << ToHex(ToBytes(request));
  }
}

INSTANTIATE_TEST_SUITE_P(Real, RealSimulatorTest, ::testing::ValuesIn(protocols::RealLines()),
                         protocols::SetupName);

TEST_F(SimulatorTest, ARequestOfUnknownLengthIsAnsweredWithoutSilence) {
  Bytes request{0xC8, 0x7E};  // no table of the protocol has a length for this function code
  const std::uint16_t check = Crc16(request);
  request.push_back(static_cast<std::uint8_t>(check & 0xFFU));
  request.push_back(static_cast<std::uint8_t>(check >> 8U));
  for (const std::size_t piece : {request.size(), std::size_t{1}}) {
    InhabitWithoutSilence(protocols::RealLine("Set4tm9600"));
    for (std::size_t at = 0; at < request.size(); at += piece) {
      Write(AsText(View(request).subspan(at, piece)));
      io_.run_for(1ms);
    }
    EXPECT_TRUE(IsAnswered(0)) << "in pieces of " << piece;
  }
}

}  // namespace
}  // namespace baudgate::tools
