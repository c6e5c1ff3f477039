// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/identification.h"

#include <algorithm>

#include "protocols/common/identification.h"

namespace baudgate::protocols::telegram {
namespace {

bool IsPolled(const Telegram& telegram, const std::vector<std::optional<ReadPlace>>& reads) {
  return std::ranges::any_of(
      reads, [&](const auto& read) { return read && read->call.telegram == telegram.name; });
}

bool IsFilled(const Form& form, const Bound& bound) {
  return std::ranges::all_of(form.pattern.elements, [&](const Element& element) {
    return !element.is_field() || element.name.empty() || element.name == kChecksum ||
           bound.contains(element.name);
  });
}

/// True if the lengths of the answers to the two telegrams always differ, so that they cannot be
/// mistaken for each other.
bool Differ(const Telegram& one, const Telegram& other) {
  for (const Form& form : one.receive) {
    const auto [least, most] = form.pattern.usual_sizes();
    for (const Form& another : other.receive) {
      const auto [other_least, other_most] = another.pattern.usual_sizes();
      if (form.size_at || another.size_at) return false;
      const bool shorter = most && *most < other_least;
      const bool longer = other_most && *other_most < least;
      if (!shorter && !longer) return false;
    }
  }
  return true;
}

bool IsPartOfOthers(const Description& description, std::size_t number) {
  return std::ranges::any_of(description.telegrams, [&](const Telegram& telegram) {
    return std::ranges::find(telegram.before, number) != telegram.before.end() ||
           std::ranges::find(telegram.behind, number) != telegram.behind.end();
  });
}

std::optional<std::size_t> IdentityTelegram(const Description& description) {
  const auto found = std::ranges::find_if(
      description.telegrams, [](const Telegram& telegram) { return !telegram.identity.empty(); });
  if (found == description.telegrams.end()) return std::nullopt;
  return static_cast<std::size_t>(found - description.telegrams.begin());
}

}  // namespace

std::optional<std::size_t> OwnProbe(const Description& description,
                                    const std::vector<std::optional<ReadPlace>>& reads,
                                    const Bound& bound) {
  if (const auto identity = IdentityTelegram(description)) return identity;
  for (std::size_t i = 0; i < description.telegrams.size(); ++i) {
    const Telegram& telegram = description.telegrams[i];
    const bool asks = telegram.reads && telegram.send && !telegram.receive.empty();
    if (!asks || IsPolled(telegram, reads) || IsPartOfOthers(description, i)) continue;
    const auto is_filled = [&](std::size_t one) {
      return IsFilled(*description.telegrams[one].send, bound);
    };
    if (!is_filled(i) || !std::ranges::all_of(telegram.before, is_filled)) continue;
    if (!std::ranges::all_of(telegram.behind, is_filled)) continue;
    const bool own = std::ranges::all_of(description.telegrams, [&](const Telegram& other) {
      return !IsPolled(other, reads) || Differ(telegram, other);
    });
    if (own) return i;
  }
  return std::nullopt;
}

Identification::Identification(const Description& description, const config::Identity& identity)
    : description_(description), identity_(identity), telegram_(IdentityTelegram(description)) {}

void Identification::OnReply(const Reply& reply) {
  const auto name = reply.fields.find(description_.telegrams[*telegram_].identity);
  if (name == reply.fields.end()) return;
  trouble_ = JudgeName(identity_, name->second.text);
  asked_ = named_ = true;
  nameless_.Forget();
}

void Identification::OnReconnect() {
  asked_ = named_ = false;
  nameless_.Forget();
}

}  // namespace baudgate::protocols::telegram
