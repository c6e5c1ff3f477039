// `ReaderTwin` simulates a reader. It sends a tag, or a text, for each raised event. If it answers
// commands, it reports the last tag.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>

#include "protocols/common/twin_points.h"
#include "protocols/reader/codec.h"
#include "protocols/reader/points.h"
#include "protocols/reader/settings.h"

namespace baudgate::protocols::reader {

class ReaderTwin final : public Twin {
 public:
  ReaderTwin(const config::Device& device, TwinValues& values);

  Bytes Answer(View request, Instant now) override;
  void ReplyAs(std::string_view) override {}
  bool Raise(const DeviceEvent& event, Now now) override;
  Bytes Say(Instant now) override;

 private:
  const Settings settings_;
  TwinPoints<Item> points_;
  std::deque<Bytes> queue_;
  Bytes there_ = EncodeTag("0000000000");
  std::uint64_t raised_ = 0;
};

}  // namespace baudgate::protocols::reader
