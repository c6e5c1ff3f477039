// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/runs/lagging_server.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace baudgate::protocols {
namespace {

/// The byte for a character with wrong parity (transports/serial_port.h).
constexpr std::uint8_t kParityError = 0xFF;
constexpr unsigned kSteps = 10;
constexpr Duration kLongestPause = 500ms;

template <typename T>
void Keep(std::deque<T>& kept, T one) {
  kept.push_back(std::move(one));
  if (kept.size() > LaggingServer::kKept) kept.pop_front();
}

}  // namespace

Duration LaggingServer::UpTo(Duration most) {
  constexpr std::int64_t kParts = 1000;
  return most * static_cast<std::int64_t>(random_() % kParts) / kParts;
}

std::vector<tools::TimedPiece> LaggingServer::OnRequest(View request, Bytes reply,
                                                        Instant end_of_request) {
  ++counts_.requests;
  Keep(requests_, Bytes(request.begin(), request.end()));
  std::vector<tools::TimedPiece> pieces;
  for (Reply& copy : std::exchange(next_time_, {})) {
    Say(std::move(copy), end_of_request + wire_.think, end_of_request, pieces);
  }
  std::erase_if(aside_, [&](const Aside& one) { return one.until < end_of_request; });
  if (reply.empty()) return pieces;
  Keep(said_, reply);
  if (OneIn(faults.drop)) {
    ++counts_.lost;
    return pieces;
  }
  std::vector<Reply> comes;
  Enqueue(Spoil(std::move(reply)), end_of_request, comes);
  Instant from = end_of_request + wire_.think;
  for (Reply& one : comes) {
    if (OneIn(faults.delay)) {
      ++counts_.late;
      from += NextDelay();
    }
    const bool twice = OneIn(faults.copy);
    const Reply copy = one;
    Say(std::move(one), from, end_of_request, pieces);
    if (!twice) continue;
    ++counts_.copies;
    if (faults.copy_comes == ServerFaults::Copy::in_place) {
      next_time_.push_back(copy);
    } else {
      const bool pause = faults.copy_comes == ServerFaults::Copy::after_a_pause;
      Say(copy, free_at_ + (pause ? UpTo(kLongestPause) : Duration()), end_of_request, pieces);
    }
  }
  return pieces;
}

void LaggingServer::Enqueue(Reply reply, Instant end_of_request, std::vector<Reply>& comes) {
  if (OneIn(faults.overtake)) {
    ++counts_.late;
    aside_.push_back({std::move(reply), end_of_request + faults.aside});
    return;
  }
  if (holding_ == 0 && OneIn(faults.hold)) {
    held_behind_ = 1 + random_() % 3;
    holding_ = held_behind_ + random_() % 6;
  }
  queue_.push_back(std::move(reply));
  std::size_t behind = faults.behind;
  if (holding_ > 0) {
    behind = std::max(behind, held_behind_);
    --holding_;
  }
  if (behind > 0) ++counts_.late;
  if (behind == 0 && queue_.size() > 1 && random_() % 2 == 0) {
    counts_.lost += queue_.size() - 1;
    queue_.erase(queue_.begin(), queue_.end() - 1);
  }
  while (queue_.size() > behind) {
    comes.push_back(std::move(queue_.front()));
    queue_.pop_front();
  }
  Release(comes);
}

void LaggingServer::Release(std::vector<Reply>& comes) {
  if (aside_.empty() || comes.empty() || random_() % 2 == 0) return;
  const bool in_front = random_() % 2 == 0;
  comes.insert(in_front ? comes.begin() : comes.end(), std::move(aside_.front().reply));
  aside_.pop_front();
}

Duration LaggingServer::NextDelay() {
  if (!faults.growing) return UpTo(faults.longest_delay);
  return faults.longest_delay * (++delays_ % kSteps + 1) / kSteps;
}

LaggingServer::Reply LaggingServer::Spoil(Bytes reply) {
  if (reply.size() > 1 && OneIn(faults.cut)) {
    ++counts_.spoilt;
    const Bytes intact = reply;
    reply.resize(1 + random_() % (reply.size() - 1));
    return {std::move(reply), intact};
  }
  if (!OneIn(faults.damage)) return {std::move(reply), {}};
  const Bytes intact = reply;
  ++counts_.spoilt;
  const config::SerialSettings& serial = wire_.serial;
  const bool parity = serial.parity != config::Parity::none;
  const auto data_bits = static_cast<unsigned>(serial.data_bits);
  std::vector<unsigned> flips(reply.size());
  for (std::size_t count = 1 + random_() % 6; count > 0; --count) {
    flips[random_() % flips.size()] ^= 1U << (random_() % (data_bits + (parity ? 1 : 0)));
  }
  for (std::size_t i = 0; i < reply.size(); ++i) {
    const bool odd = parity && std::popcount(flips[i]) % 2 != 0;
    const auto bits = static_cast<std::uint8_t>(flips[i] & ((1U << data_bits) - 1));
    reply[i] = odd ? kParityError : static_cast<std::uint8_t>(reply[i] ^ bits);
  }
  if (reply == intact) return {std::move(reply), {}};
  return {std::move(reply), intact};
}

void LaggingServer::Say(Reply reply, Instant from, Instant end_of_request,
                        std::vector<tools::TimedPiece>& pieces) {
  const Instant at = std::max(from, free_at_) + wire_.TimeOf(reply.bytes.size());
  free_at_ = at;
  Keep(arrivals_, Arrival{at, reply.bytes, reply.intact});
  pieces.push_back({at - end_of_request, std::move(reply.bytes)});
}

}  // namespace baudgate::protocols
