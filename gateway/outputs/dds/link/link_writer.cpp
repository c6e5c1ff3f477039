// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/link/link_writer.h"

#include "gateway/outputs/dds/link/packet_socket.h"

namespace baudgate::dds {
namespace {

// The process tells the ends of the points, gives subscribers 100 ms to take them, and deletes its
// participant and writers.
constexpr Duration kGoodbye = kEndTime + 350ms;
constexpr Duration kRoomPause = 5ms;  // until a full socket is tried again

}  // namespace

template <typename Sample>
Sent LinkWriter::Put(LinkKind kind, const Sample& sample) {
  const MutexLock lock(mutex_);
  if (socket_ < 0 || reopening_) return Sent::later;
  const std::size_t size = EncodeSample(kind, sample, packet_);
  return size == 0 ? Sent::refused : SendHeld(size);
}

Sent LinkWriter::Write(const PointSample& sample) { return Put(LinkKind::point, sample); }
Sent LinkWriter::Write(const DeviceSample& sample) { return Put(LinkKind::device, sample); }
Sent LinkWriter::Write(const GatewaySample& sample) { return Put(LinkKind::gateway, sample); }
Sent LinkWriter::Write(const EventSample& sample) { return Put(LinkKind::event, sample); }
Sent LinkWriter::Write(const AlarmSample& sample) { return Put(LinkKind::alarm, sample); }
Sent LinkWriter::Write(const ReplySample& reply) { return Put(LinkKind::reply, reply); }

Sent LinkWriter::SendHeld(std::size_t size) {
  switch (SendPacket(socket_, View(packet_).first(size))) {
    case PacketSent::yes:
      return Sent::yes;
    case PacketSent::full:
    case PacketSent::closed:  // whoever reads the socket sees that, too, and detaches
      break;
  }
  return Sent::later;
}

bool LinkWriter::WaitAcknowledged(Duration most) {
  MutexLock lock(mutex_);
  ending_ = true;
  if (socket_ < 0) return false;
  Instant now = std::chrono::steady_clock::now();
  const Instant until = now + most + kGoodbye;
  bool told = false;
  while (socket_ >= 0) {
    told = told || SendPacket(socket_, EncodeBare(LinkKind::end)) == PacketSent::yes;
    if (now >= until) return false;
    lock.WaitUntil(detached_, told ? until : now + kRoomPause);
    now = std::chrono::steady_clock::now();
  }
  return left_;
}

Sent LinkWriter::Reopen(const Room& room) {
  const MutexLock lock(mutex_);
  open_.room = room;
  if (socket_ < 0 || reopening_) return Sent::later;
  reopening_ = SendPacket(socket_, EncodeOpen(open_)) == PacketSent::yes;
  return reopening_ ? Sent::yes : Sent::later;
}

LinkOpen LinkWriter::open() const {
  const MutexLock lock(mutex_);
  return open_;
}

Subscribers LinkWriter::subscribers() const {
  const MutexLock lock(mutex_);
  return subscribers_;
}

std::uint64_t LinkWriter::session() const {
  const MutexLock lock(mutex_);
  return socket_ < 0 ? 0 : sessions_;
}

void LinkWriter::OnSession(const std::function<void()>& changed) {
  const MutexLock lock(telling_);
  on_session_ = changed;
}

void LinkWriter::OnRequest(TakeRequest take) {
  const MutexLock lock(telling_);
  on_request_ = std::move(take);
}

void LinkWriter::HandOn(WriteArrival arrival) const {
  const MutexLock lock(telling_);
  if (on_request_) on_request_(std::move(arrival));
}

void LinkWriter::Attach(int socket) {
  {
    const MutexLock lock(mutex_);
    socket_ = socket;
    ++sessions_;
    left_ = reopening_ = false;
  }
  TellSession();
}

void LinkWriter::Detach() {
  {
    const MutexLock lock(mutex_);
    socket_ = -1;
    reopening_ = false;
    subscribers_ = {};
  }
  detached_.notify_all();
  TellSession();
}

void LinkWriter::SetSubscribers(const Subscribers& subscribers) {
  bool events_wait = false;
  {
    const MutexLock lock(mutex_);
    events_wait = subscribers_.events == 0 && subscribers.events > 0;
    subscribers_ = subscribers;
  }
  if (events_wait) TellSession();
}

void LinkWriter::SetLeft() {
  const MutexLock lock(mutex_);
  left_ = true;
}

bool LinkWriter::ending() const {
  const MutexLock lock(mutex_);
  return ending_;
}

void LinkWriter::TellSession() const {
  const MutexLock lock(telling_);
  if (on_session_) on_session_();
}

}  // namespace baudgate::dds
