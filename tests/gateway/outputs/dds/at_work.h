// `AtWork`: a gateway with one point and a subscriber, which tests attack.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "gateway/outputs/dds/fast/subscriber.h"
#include "tests/gateway/outputs/dds/datagrams.h"
#include "tests/gateway/outputs/dds/fixture.h"

namespace baudgate::dds::testing {

class AtWork : public ::testing::Test {
 protected:
  void SetUp() override {
    auto made = DdsSubscriber::Create(TestSubscriber(), heard_.Callbacks());
    ASSERT_TRUE(made.ok()) << made.error();
    subscriber_ = std::move(*made);
    publisher_ = Publish(config_, store_);
    ASSERT_TRUE(SampleArrives());
  }

  bool SampleArrives() {
    const double value = ++value_;
    Set(store_, 0, 0, value);
    return heard_.WaitFor([&] { return heard_.points[{"feeder-0", "p0"}].value == value; });
  }

  const config::Config config_ = MakeConfig(1, 1);
  bus::PointStore store_{config_};
  Published heard_;
  std::unique_ptr<DdsSubscriber> subscriber_;
  std::unique_ptr<DdsPublisher> publisher_;
  DatagramSender attacker_{TestDomain()};
  double value_ = 0;
};

}  // namespace baudgate::dds::testing
