// SPDX-License-Identifier: Apache-2.0
#include "transports/port_thread.h"

namespace baudgate {
namespace {

/// A pty may bring bytes faster than a busy server takes them. No frame survives what is dropped.
constexpr std::size_t kMostUnheard = 64 * 1024;

}  // namespace

PortThread::PortThread(asio::io_context& server, const std::string& path, const MakePort& make,
                       Owner& owner)
    : server_(server),
      owner_(owner),
      port_(make(loop_.io(), *this)),
      keeper_(loop_.io(), path, [this] { port_->Open(); }) {
  loop_.Start();
}

void PortThread::Start() {
  running_ = std::make_shared<char>();
  asio::post(loop_.io(), [this] { port_->Open(); });
}

void PortThread::Stop() {
  loop_.Stop([this] {
    keeper_.Stop();
    port_->Close();
  });
  running_.reset();
}

void PortThread::Send(Bytes bytes) {
  asio::post(loop_.io(), [this, bytes = std::move(bytes)] {
    if (port_->is_open()) port_->Send(bytes);
  });
}

void PortThread::OnOpened() {
  keeper_.OnOpened();
  Tell([this, description = port_->Describe()] { owner_.OnOpened(description); });
}

void PortThread::Down(const std::string& reason) {
  const bool is_news = keeper_.OnDown(reason);
  Tell([this, reason, is_news] { owner_.OnDown(reason, is_news); });
}

void PortThread::OnBytes(View bytes) {
  if (unheard_ + bytes.size() > kMostUnheard) return;
  unheard_ += bytes.size();
  Tell([this, at = ReadClocks().instant, bytes = Bytes(bytes.begin(), bytes.end())] {
    unheard_ -= bytes.size();
    owner_.OnBytes(bytes, at);
  });
}

}  // namespace baudgate
