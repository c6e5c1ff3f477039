// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/drive_plc.h"

#include <fmt/format.h>
#include <poll.h>

#include <cstdlib>

#include "gateway/base/text.h"

namespace baudgate::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr Duration kBetweenEvents = 700ms;
constexpr int kEvents = 25;
constexpr std::uint16_t kRunCommand = 8;
constexpr std::uint16_t kSetFrequency = 13;
constexpr std::uint16_t kFrequency = 200;

Bytes Adu(std::uint16_t transaction, const std::string& pdu) {
  const Bytes body = ParseHex(pdu).value();
  Bytes frame;
  const auto put = [&frame](std::size_t word) {
    frame.push_back(static_cast<std::uint8_t>(word >> 8));
    frame.push_back(static_cast<std::uint8_t>(word));
  };
  put(transaction);
  put(0);
  put(body.size() + 1);
  frame.push_back(20);
  Append(frame, body);
  return frame;
}

std::string Read(std::uint16_t address, std::uint16_t count) {
  return fmt::format("03 {:02X} {:02X} {:02X} {:02X}", address >> 8, address & 0xFF, count >> 8,
                     count & 0xFF);
}
std::string Write(std::uint16_t address, std::uint16_t value) {
  return fmt::format("06 {:02X} {:02X} {:02X} {:02X}", address >> 8, address & 0xFF, value >> 8,
                     value & 0xFF);
}
std::string WriteBlock() {
  std::string pdu = "10 03 E7 00 78 F0";
  for (int i = 0; i < 240; ++i) pdu += " 00";
  return pdu;
}

}  // namespace

std::string StartPdu() { return Write(kRunCommand, 2); }

Plc::Plc(std::uint16_t port, std::uint16_t watch_port, bool blocks)
    : client_(port), watch_(watch_port), blocks_(blocks) {
  cyclic_ = {{Read(500, 1)},
             {Read(kFrequency, 1)},
             {Read(201, 1)},
             {Read(kRunCommand, 1)},
             {Write(kSetFrequency, 2500)}};
}

void Plc::Run() {
  Instant next_event = Clock::now() + kBetweenEvents;
  int events = 0;
  bool running = false;
  while (events < 2 * kEvents) {
    const Instant now = Clock::now();
    for (Message& message : cyclic_) Fire(message, now);
    if (blocks_) FireBlocks();
    if (now >= next_event) {
      running = !running;
      starts_pending_ = running ? std::optional(now) : std::nullopt;
      if (running) starts.push_back({Clock::now(), {}});
      Send(running ? StartPdu() : Write(kRunCommand, 0), nullptr);
      next_event = now + kBetweenEvents;
      ++events;
    }
    Receive();
  }
}

void Plc::Fire(Message& message, Instant now) {
  if (message.waits || now < message.next) return;
  message.waits = true;
  message.next = now + kPlcPeriod;
  Send(message.pdu, &message);
}

void Plc::FireBlocks() {
  if (block_.waits) return;
  block_.waits = true;
  const std::size_t turn = block_turn_++ % (kBlocks.size() + 1);
  const auto count = static_cast<std::uint16_t>(turn == kBlocks.size() - 1 ? 40 : 120);
  Send(turn < kBlocks.size() ? Read(kBlocks[turn], count) : WriteBlock(), &block_);
}

void Plc::Send(const std::string& pdu, Message* message) {
  sent_[++transaction_] = {pdu, message};
  const RawClient& client = message == &cyclic_[1] ? watch_ : client_;
  client.Send(Adu(transaction_, pdu));
}

void Plc::Receive() {
  pollfd ready[] = {{client_.socket(), POLLIN, 0}, {watch_.socket(), POLLIN, 0}};
  while (poll(ready, 2, 1) > 0) {
    const bool watched = (ready[1].revents & POLLIN) != 0;
    const Bytes reply = (watched ? watch_ : client_).ReceiveFrame();
    const Instant now = Clock::now();
    if (reply.size() < 9) std::exit(4);
    const auto found = sent_.find(static_cast<std::uint16_t>(reply[0] << 8 | reply[1]));
    if (found == sent_.end()) {
      ++mismatches;
      continue;
    }
    ++answered;
    const Sent sent = found->second;
    sent_.erase(found);
    if (sent.message != nullptr) sent.message->waits = false;
    if ((reply[7] & 0x80) != 0) ++exceptions;
    if ((reply[7] & 0x7F) != ParseHex(sent.pdu).value()[0]) ++mismatches;
    const bool frequency = sent.message == &cyclic_[1] && reply.size() == 11;
    if (frequency && starts_pending_ && (reply[9] != 0 || reply[10] != 0)) {
      starts.back().seen = now;
      starts_pending_.reset();
    }
  }
}

}  // namespace baudgate::bench
