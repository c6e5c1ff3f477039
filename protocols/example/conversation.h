// `ExampleConversation` makes the requests to one example device and interprets its replies.
#pragma once

#include <vector>

#include "config/model/device.h"
#include "protocols/conversation.h"

namespace baudgate::protocols::example {

class ExampleConversation final : public Conversation {
 public:
  explicit ExampleConversation(const config::Device& device);

  std::span<const Query> Queries() const override { return queries_; }
  Result<Request> Ask(const Task& task, Instant now) override;
  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override;
  Outcome Check(View request, View frame) const override;
  Answer Interpret(View request, View frame) override;

 private:
  const config::Device& device_;
  const char address_;
  std::vector<Query> queries_;
};

}  // namespace baudgate::protocols::example
