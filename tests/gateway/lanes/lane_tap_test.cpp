// What the recorder of a line hears of several exchanges at a time.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/lanes/lane_tap.h"

#include <gmock/gmock.h>

#include "gateway/base/text.h"

namespace baudgate {
namespace {

using testing::ElementsAre;

struct Heard final : Tap {
  void OnSent(std::uint32_t device, const Request& request, Now now) override {
    Add(std::to_string(device) + " > " + ToHex(request.bytes), now);
  }
  void OnReceived(View bytes, Now now) override { Add("< " + ToHex(bytes), now); }
  void OnExchangeEnd(std::uint32_t device, const ExchangeEnd& end, Now now) override {
    Add(std::to_string(device) + " " + std::string(Name(end.outcome)), now);
  }
  void OnDeviceState(std::uint32_t device, DeviceState, const std::string&, Now now) override {
    Add(std::to_string(device) + " state", now);
  }
  void Add(const std::string& text, Now now) {
    all.push_back(text + " at " + std::to_string(now.instant.time_since_epoch() / 1s));
  }
  std::vector<std::string> all;
};

Now At(int second) { return {Instant() + second * 1s, WallTime(second * 1s)}; }

ExchangeEnd EndOf(Outcome outcome) {
  ExchangeEnd end;
  end.outcome = outcome;
  return end;
}

Request RequestOf(std::uint8_t byte) {
  Request request;
  request.bytes = {byte};
  return request;
}

TEST(LaneTap, AnExchangeIsToldAsAWhole) {
  Heard heard;
  LaneTap one;
  LaneTap other;
  one.Attach(heard);
  other.Attach(heard);
  one.OnSent(1, RequestOf(0x11), At(1));
  other.OnSent(2, RequestOf(0x22), At(2));
  one.OnReceived(Bytes{0xAA}, At(3));
  other.OnReceived(Bytes{0xBB}, At(4));
  one.OnReceived(Bytes{0xAC}, At(5));
  other.OnExchangeEnd(2, EndOf(Outcome::ok), At(6));
  one.OnExchangeEnd(1, EndOf(Outcome::corrupt), At(7));
  EXPECT_THAT(heard.all, ElementsAre("2 > 22 at 2", "< BB at 4", "2 ok at 6", "1 > 11 at 1",
                                     "< AA at 3", "< AC at 5", "1 corrupt at 7"));
}

TEST(LaneTap, WhatHasNoEndIsToldAllTheSame) {
  Heard heard;
  LaneTap tap;
  tap.Attach(heard);
  tap.OnSent(1, RequestOf(0x11), At(1));
  tap.OnSent(1, RequestOf(0x12), At(2));
  tap.Flush();
  tap.OnReceived(Bytes{0xAA}, At(3));
  EXPECT_THAT(heard.all, ElementsAre("1 > 11 at 1", "1 > 12 at 2", "< AA at 3"));
}

}  // namespace
}  // namespace baudgate
