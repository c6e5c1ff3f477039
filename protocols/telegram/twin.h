// `TelegramTwin` simulates a described device. Fields that no point reads are as in the example of
// the telegram.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "protocols/telegram/points.h"
#include "protocols/twin.h"

namespace baudgate::protocols::telegram {

class TelegramTwin final : public Twin {
 public:
  TelegramTwin(const config::Device& device, TwinValues& values);

  Bytes Answer(View request, Instant now) override;
  void ReplyAs(std::string_view address) override;
  bool Raise(const DeviceEvent& event, Now now) override;
  Bytes Say(Instant now) override;

 private:
  bool IsForMe(const Bound& sent) const;
  Bound Told(std::size_t telegram, const Bound& sent);
  void Write(std::size_t telegram, const Bound& sent);
  Bytes Compose(std::size_t telegram, const Bound& sent, Instant now) const;
  void PutValue(const Telegram& telegram, const Example& usual, const Element& element,
                std::size_t point, Instant now, Bound& values) const;

  TwinValues& values_;
  const std::shared_ptr<const Description> description_;  // null: the twin never answers
  const Bound bound_;
  std::optional<Value> reply_as_;
  std::vector<std::optional<ReadPlace>> reads_;  // by point
  std::vector<std::optional<Call>> writes_;
  Questions read_;  // by point
  Questions written_;
  std::map<std::size_t, Bound> told_;  // by telegram: its fields when it was sent last
  // unasked messages that Say sends next
  std::deque<Bytes> said_;
};

}  // namespace baudgate::protocols::telegram
