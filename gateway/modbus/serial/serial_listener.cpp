// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/serial/serial_listener.h"

#include "gateway/base/log.h"
#include "transports/serial_port.h"

namespace baudgate::modbus {

SerialListener::SerialListener(asio::io_context& io, const config::Listener& listener,
                               PointDesk& points, const Protocol& rtu)
    : listener_(listener),
      points_(points),
      place_(points.book()->AddMaster(listener.path, ReadClocks().wall)),
      rtu_(rtu),
      port_(
          io, listener.path,
          [&listener](asio::io_context& port_io, TransportListener& heard) {
            return MakeSerialPort(listener.path, listener.serial, port_io, heard);
          },
          *this),
      timer_(io) {}

void SerialListener::Stop() {
  port_.Stop();
  timer_.cancel();
  session_.reset();
}

void SerialListener::OnOpened(const std::string& description) {
  const Now now = ReadClocks();
  log::Info("modbus: listening for a master on {}", description);
  points_.book()->ShowPort(place_, true, description, now.wall);
  session_.emplace(listener_, points_, rtu_, place_, *this, now);
}

void SerialListener::OnDown(const std::string& reason, bool is_news) {
  timer_.cancel();
  session_.reset();
  if (!is_news) return;
  log::Warn("modbus: no master is heard on {}: {}; trying again until it works", listener_.path,
            reason);
  points_.book()->ShowPort(place_, false, reason, ReadClocks().wall);
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
