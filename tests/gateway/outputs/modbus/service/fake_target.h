// A route target that stores requests, answers them at once, or refuses as full.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/text.h"
#include "gateway/bus/writes/route_queue.h"

namespace baudgate::modbus {

inline constexpr const char* kRead = "03 01 F4 00 01";

inline bus::RoutedReply GoodReply(Bytes pdu) {
  bus::RoutedReply reply;
  reply.outcome = Outcome::ok;
  reply.pdu = std::move(pdu);
  reply.sent = true;
  return reply;
}

inline bus::RoutedReply GoodReply(const std::string& hex) {
  return GoodReply(ParseHex(hex).value());
}

inline bus::RoutedReply SlaveException(const std::string& hex) {
  bus::RoutedReply reply = GoodReply(hex);
  reply.outcome = Outcome::refused;
  return reply;
}

inline bus::RoutedReply Trouble(Outcome outcome, const std::string& reason, bool sent = true) {
  bus::RoutedReply reply;
  reply.outcome = outcome;
  reply.reason = reason;
  reply.sent = sent;
  return reply;
}

class FakeTarget final : public bus::RouteTarget {
 public:
  bool Submit(bus::RoutedRequest request) override {
    std::unique_lock lock(mutex_);
    if (full) return false;
    requests_.push_back(request);
    arrived_.notify_all();
    lock.unlock();
    if (answer) request.done(answer(request));
    return true;
  }
  void Abandon(std::uint64_t client) override {
    const std::lock_guard lock(mutex_);
    forgotten_.push_back(client);
    arrived_.notify_all();
  }

  /// Waits, without a time limit, for the request with this number, counted from 0. WaitForgotten
  /// waits for the client of this number that leaves.
  bus::RoutedRequest Wait(std::size_t number) {
    std::unique_lock lock(mutex_);
    arrived_.wait(lock, [&] { return requests_.size() > number; });
    return requests_[number];
  }
  std::uint64_t WaitForgotten(std::size_t number) {
    std::unique_lock lock(mutex_);
    arrived_.wait(lock, [&] { return forgotten_.size() > number; });
    return forgotten_[number];
  }
  std::size_t count() const {
    const std::lock_guard lock(mutex_);
    return requests_.size();
  }
  std::vector<std::uint64_t> forgotten() const {
    const std::lock_guard lock(mutex_);
    return forgotten_;
  }

  // The two members below must be set before clients start.
  bool full = false;
  std::function<bus::RoutedReply(const bus::RoutedRequest&)> answer;  ///< empty: the test answers

 private:
  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<bus::RoutedRequest> requests_;
  std::vector<std::uint64_t> forgotten_;
};

inline void AddRoutedLines(config::Config& config) {
  for (const char* name : {"drive", "pumps"}) {
    config.lines.emplace_back().name = name;
  }
}

inline config::Route RouteTo(const config::Config& config, std::size_t line, std::uint8_t first,
                             std::uint8_t last) {
  config::Route route;
  route.first = first;
  route.last = last;
  route.line = config.lines[line].name;
  route.line_index = line;
  return route;
}

}  // namespace baudgate::modbus
