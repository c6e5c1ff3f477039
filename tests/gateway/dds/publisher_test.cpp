// The publisher's thread: what it refuses to start with, and that it sends and ends. What it sends
// is judged in sample_sender_test.cpp.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/publisher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "tests/gateway/dds/fixture.h"
#include "tests/gateway/dds/remembering_writer.h"

namespace baudgate::dds {
namespace {

using testing::MakeConfig;
using testing::RememberingWriter;

/// Lets the test wait until a value has been sent, and outlives the publisher that owns the writer.
struct Sent {
  std::promise<void> value;
  std::vector<std::string> disposed;
};

class TellingWriter : public RememberingWriter {
 public:
  explicit TellingWriter(Sent& sent) : sent_(sent) {}
  ~TellingWriter() override { sent_.disposed = disposed; }
  bool Write(const PointSample& sample) override {
    if (sample.value == 2.5) sent_.value.set_value();
    return RememberingWriter::Write(sample);
  }
  using RememberingWriter::Write;

 private:
  Sent& sent_;
};

TEST(Publisher, SendsOnItsThreadUntilItIsStopped) {
  const config::Config config = MakeConfig(2, 2);
  PointStore store(config);
  Sent sent;
  auto publisher =
      std::move(*DdsPublisher::Create(config, store, std::make_unique<TellingWriter>(sent)));
  testing::Set(store, 1, 1, 2.5);
  sent.value.get_future().wait();
  publisher->Stop();
  publisher->Stop();
  EXPECT_GE(publisher->counters().written, 1U);
  publisher.reset();
  EXPECT_THAT(sent.disposed, ::testing::Contains("feeder-1.p1"));
}

TEST(Publisher, RefusesNamesThatAreNoKeys) {
  config::Config config = MakeConfig(1, 1);
  config.lines[0].devices[0].points[0].name = std::string(65, 'p');
  PointStore store(config);
  const auto publisher = DdsPublisher::Create(config, store, std::make_unique<RememberingWriter>());
  ASSERT_FALSE(publisher.ok());
  EXPECT_THAT(publisher.error(), ::testing::HasSubstr("longer than 64"));
}

}  // namespace
}  // namespace baudgate::dds
