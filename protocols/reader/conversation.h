// `ReaderConversation` reports each tag or text that a reader sends. With `commands: ask` it also
// asks for the present tag, and once for the reader's name.
#pragma once

#include <deque>
#include <map>
#include <vector>

#include "config/model/device.h"
#include "protocols/conversation.h"
#include "protocols/reader/points.h"
#include "protocols/reader/settings.h"

namespace baudgate::protocols::reader {

class ReaderConversation final : public Conversation {
 public:
  ReaderConversation(const config::Device& device, const Settings& settings);

  /// Returns no queries unless `commands: ask` is set.
  std::span<const Query> Queries() const override { return queries_; }
  Result<Request> Ask(const Task& task, Instant now) override;
  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override;
  Outcome Check(View request, View frame) const override;
  Answer Interpret(View request, View frame) override;

  const Standing* Listens() const override { return &standing_; }
  Answer OnUnasked(View message, Now received) override;
  std::optional<Instant> DueAt() const override { return gone_at_; }
  Answer OnDue(Now now) override;
  /// Records by when the reply to `request` must come, see TakeAnswer.
  void Stamp(Request& request, Now arrives, Duration character) override;
  /// Gets the number of the last tag before a restart; the numbers of new tags go on from there.
  void OnEventsKept(std::string_view said) override;

 private:
  bool IsKnown(const std::string& text, Instant now);
  bool TakeAnswer(const std::string& text, Instant now);
  void Remember(const std::string& text, Instant now);
  void AddTag(const std::string& text, Now received, Answer& answer);
  void TellRing(Answer& answer) const;
  void Tell(Item::Kind kind, const Decoded& decoded, Answer& answer) const;

  const config::Device& device_;
  const Settings settings_;
  const std::vector<Item> items_;  // index: point
  const std::vector<Query> queries_;
  const Standing standing_;
  // For each point: true after its first number. Before that, a message without a number gives the
  // point no bad reading.
  std::vector<bool> had_number_;
  std::deque<Tag> ring_;                   // the last tags, the newest first
  std::map<std::string, Instant> latest_;  // when each text of the last same_tag came last
  std::string last_;                       // the text of the last message; empty: no tag
  // For each outstanding reply to `r`: when it must have come at the latest.
  std::deque<Instant> owed_;
  std::uint64_t counter_ = 0;
  bool recalled_ = false;
  std::uint64_t repeats_ = 0;
  std::optional<Instant> gone_at_;  // when the present tag counts as gone
};

}  // namespace baudgate::protocols::reader
