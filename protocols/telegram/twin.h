// `TelegramTwin` simulates a described device. Fields that no point reads have the values of the
// telegram's example.
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
  const std::shared_ptr<const Description>
      description_;  // null: the simulated device never answers
  const Bound bound_;
  std::optional<Value> reply_as_;
  std::vector<std::optional<ReadPlace>> reads_;  // index: point
  std::vector<std::optional<Call>> writes_;
  // The calls in the `read` of points, and (written_) in their `write`; index: point.
  Questions read_;
  Questions written_;
  std::map<std::size_t, Bound> told_;  // for each telegram: its fields when it was sent last
  // Unasked messages that are not sent yet; Say sends them.
  std::deque<Bytes> said_;
};

}  // namespace baudgate::protocols::telegram
