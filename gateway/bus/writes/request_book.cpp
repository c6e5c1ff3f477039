// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/writes/request_book.h"

#include <algorithm>
#include <utility>

namespace baudgate::bus {

namespace {

using What = RequestBook::Verdict::What;

RequestBook::Verdict Refused(WriteEnd end, std::string reason) {
  return {What::refused, {end, std::move(reason)}};
}

}  // namespace

RequestBook::Verdict RequestBook::Begin(const RequestId& request, Instant now) {
  if (!ReadPast(now)) {
    return Refused(
        WriteEnd::busy,
        "nothing was written, because the record of earlier writes is still being read; try again");
  }
  Client* const client = PlaceFor(request.client, now);
  if (client == nullptr) {
    return Refused(WriteEnd::busy,
                   "nothing was written, because too many clients have sent requests within the "
                   "last ten minutes; try again later");
  }
  client->last = now;
  const auto known = client->entries.find(request.seq);
  if (known != client->entries.end()) {
    const Entry& entry = known->second;
    if (entry.content != request.content) {
      return Refused(WriteEnd::denied,
                     "nothing was written, because this client has used this seq for another "
                     "request; use a higher seq");
    }
    return entry.answer ? Verdict{What::answered, *entry.answer} : Verdict{What::under_way, {}};
  }
  if (client->forgotten && request.seq <= *client->forgotten) {
    return Refused(WriteEnd::denied, "nothing was written, because seq is too old: only the last " +
                                         std::to_string(kRemembered) +
                                         " requests of a client are remembered; use a higher seq");
  }
  if (client->entries.size() >= kRemembered) ForgetOldest(*client);
  Entry& entry = client->entries[request.seq];
  entry.content = request.content;
  if (client->under_way < kUnderWay) {
    ++client->under_way;
    return {};
  }
  entry.answer = {WriteEnd::busy, "nothing was written, because " + std::to_string(kUnderWay) +
                                      " requests of this client are under way; wait for replies"};
  return {What::refused, *entry.answer};
}

/// Reads the requests of earlier runs into the book. Returns false if they are not known yet.
bool RequestBook::ReadPast(Instant now) {
  if (past_ == nullptr) return true;
  const auto past = past_();
  if (!past) return false;
  for (const PastRequest& one : past->all) Restore(one, now);
  if (past->complete) past_ = nullptr;
  return true;
}

/// Adds a request of an earlier run. The latest requests are added first. When there is no space
/// for an older one, its number counts as forgotten, so that it is not carried out again.
void RequestBook::Restore(const PastRequest& past, Instant now) {
  const bool known = clients_.contains(past.id.client);
  if (!known && clients_.size() >= kClients) return;
  Client& client = clients_[past.id.client];
  if (!known) client.last = now - std::min(past.age, kKept);
  if (client.entries.contains(past.id.seq)) return;
  if (client.entries.size() >= kRemembered) {
    client.forgotten = std::max(client.forgotten.value_or(0), past.id.seq);
    return;
  }
  client.entries[past.id.seq] = {past.id.content, RequestAnswer{past.end, past.reason, past.took}};
}

void RequestBook::End(const std::string& client, std::uint64_t seq, RequestAnswer answer) {
  const auto at = clients_.find(client);
  if (at == clients_.end()) return;
  const auto entry = at->second.entries.find(seq);
  if (entry == at->second.entries.end() || entry->second.answer) return;
  entry->second.answer = std::move(answer);
  --at->second.under_way;
}

/// Returns the entry of a client. If all entries are in use, a new client replaces the client that
/// was silent longest. Null: that client has a request under way, or was silent for less than
/// kKept.
RequestBook::Client* RequestBook::PlaceFor(const std::string& client, Instant now) {
  const auto known = clients_.find(client);
  if (known != clients_.end()) return &known->second;
  if (clients_.size() >= kClients) {
    const auto longest_silent = std::ranges::min_element(clients_, {}, [](const auto& one) {
      return one.second.under_way > 0 ? Instant::max() : one.second.last;
    });
    const Client& silent = longest_silent->second;
    if (silent.under_way > 0 || now - silent.last < kKept) return nullptr;
    clients_.erase(longest_silent);
  }
  return &clients_[client];
}

/// Removes the answered request with the lowest number. There always is one, because fewer requests
/// can be under way than are remembered.
void RequestBook::ForgetOldest(Client& client) {
  const auto oldest = std::ranges::find_if(
      client.entries, [](const auto& one) { return one.second.answer.has_value(); });
  client.forgotten = std::max(client.forgotten.value_or(0), oldest->first);
  client.entries.erase(oldest);
}

}  // namespace baudgate::bus
