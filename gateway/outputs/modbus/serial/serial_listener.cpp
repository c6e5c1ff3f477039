// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/serial/serial_listener.h"

#include <utility>

#include "gateway/base/log.h"
#include "transports/serial_port.h"

namespace baudgate::modbus {

SerialListener::SerialListener(asio::io_context& io, config::Listener listener,
                               ServerShared& shared)
    : listener_(std::move(listener)),
      shared_(shared),
      book_(*shared.book()),
      port_(
          io, listener_.path,
          [this](asio::io_context& port_io, TransportListener& heard) {
            return MakeSerialPort(listener_.path, listener_.serial, port_io, heard);
          },
          *this),
      place_(book_.AddMaster(listener_, ReadClocks().wall)),
      timer_(io) {}

void SerialListener::Leave() {
  if (std::exchange(left_, true)) return;
  timer_.cancel();
  session_.reset();
  book_.RemoveMaster(place_);
}

void SerialListener::Stop() {
  Leave();
  ClosePort();
}

void SerialListener::OnOpened(const std::string& description) {
  if (left_) return;
  const Now now = ReadClocks();
  log::Info("modbus: listening for a master on {}", description);
  book_.ShowPort(place_, true, description, now.wall);
  session_.emplace(listener_, shared_, place_, *this, now);
}

void SerialListener::OnDown(const std::string& reason, bool is_news) {
  if (left_) return;
  timer_.cancel();
  session_.reset();
  if (!is_news) return;
  log::Warn("modbus: no master is heard on {}: {}; trying again until it works", listener_.path,
            reason);
  book_.ShowPort(place_, false, reason, ReadClocks().wall);
}

void SerialListener::OnBytes(View bytes, Instant at) {
  if (!session_) return;
  session_->OnBytes(bytes, {at, ReadClocks().wall});
  Rearm();
}

void SerialListener::Rearm() {
  const auto next = session_->Deadline();
  if (!next) {
    timer_.cancel();
    return;
  }
  timer_.expires_at(*next);
  timer_.async_wait([self = weak_from_this()](const asio::error_code& error) {
    const auto listener = self.lock();
    if (error || !listener || !listener->session_) return;
    listener->session_->OnTime(ReadClocks());
    listener->Rearm();
  });
}

}  // namespace baudgate::modbus
