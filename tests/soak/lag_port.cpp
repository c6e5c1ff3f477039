// SPDX-License-Identifier: Apache-2.0
#include "tests/soak/lag_port.h"

#include <fmt/format.h>

#include <asio/write.hpp>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate {
namespace {

constexpr std::size_t kKept = 60;

Instant ReadClock() { return std::chrono::steady_clock::now(); }

}  // namespace

LagPort::LagPort(asio::io_context& io, const protocols::Protocol& protocol,
                 const config::Options& options, const tools::TwinWire& wire,
                 const std::string& path, OnRequest on_request)
    : wire_(wire),
      pty_(std::move(*tools::Pty::Create(path))),
      descriptor_(io, pty_.TakeMaster()),
      timer_(io),
      on_request_(std::move(on_request)) {
  descriptor_.non_blocking(true);
  assembler_.Begin(protocol.request_rule, protocol.expect({}, ParseOptions(protocol, options)));
  Read();
}

void LagPort::Read() {
  descriptor_.async_read_some(asio::buffer(buffer_),
                              [this](const asio::error_code& error, std::size_t count) {
                                if (error) return;
                                Take(View(buffer_).first(count));
                                Read();
                              });
}

/// Passes each request on at the time at which its last character would have arrived over a wire.
void LagPort::Take(View bytes) {
  assembler_.Feed(bytes);
  while (const auto request = NextRequest()) {
    Keep(true, *request);
    const Instant end = ReadClock() + wire_.TimeOf(request->size());
    for (tools::TimedPiece& piece : on_request_(*request, end))
      leaving_.emplace(end + piece.after, std::move(piece.bytes));
  }
  SendNext();
}

/// Returns the next request. A request whose end only silence marks is returned at once, if all
/// bytes in the assembler belong to it.
std::optional<Bytes> LagPort::NextRequest() {
  if (auto frame = assembler_.Next(false)) return frame;
  protocols::Assembler after_silence = assembler_;
  auto frame = after_silence.Next(true);
  if (!frame || after_silence.counters().discarded != assembler_.counters().discarded) return {};
  assembler_ = std::move(after_silence);
  return frame;
}

void LagPort::SendNext() {
  if (leaving_.empty()) return;
  timer_.expires_at(leaving_.begin()->first);
  timer_.async_wait([this](const asio::error_code& error) {
    if (error) return;
    while (!leaving_.empty() && leaving_.begin()->first <= ReadClock()) {
      const auto piece = leaving_.extract(leaving_.begin());
      Keep(false, piece.mapped());
      asio::error_code ignored;
      asio::write(descriptor_, asio::buffer(piece.mapped()), ignored);
    }
    SendNext();
  });
}

void LagPort::Keep(bool is_request, View bytes) {
  passed_.push_back({ReadClock(), is_request, Bytes(bytes.begin(), bytes.end())});
  if (passed_.size() > kKept) passed_.pop_front();
}

std::string LagPort::Latest() const {
  const Instant now = ReadClock();
  std::string text;
  for (const Passed& one : passed_) {
    text += fmt::format("  {:8} ms  {}", (one.at - now) / 1ms, one.is_request ? "->" : "<-");
    for (const std::uint8_t byte : one.bytes) text += fmt::format(" {:02X}", byte);
    text += '\n';
  }
  return text;
}

}  // namespace baudgate
