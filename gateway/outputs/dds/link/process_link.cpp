// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/link/process_link.h"

#include <poll.h>
#include <pwd.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate::dds {
namespace {

constexpr std::array<Duration, 6> kLadder{100ms, 500ms, 1s, 2s, 5s, 10s};
constexpr Duration kLongLife = 1min;

}  // namespace

LinkKeeper::Wish LinkKeeper::Look(Instant now) {
  using Phase = LinkState::Phase;
  if (state_.phase == Phase::waiting) {
    const bool due = first_ || (state_.next_start && now >= *state_.next_start);
    return starts_ && due ? Wish::start : Wish::nothing;
  }
  if (now - state_.heard >= patience()) return Wish::give_up;
  if (now - state_.heard >= kSilent) state_.phase = Phase::silent;
  return Wish::nothing;
}

Instant LinkKeeper::NextLook() const {
  using Phase = LinkState::Phase;
  if (state_.phase == Phase::silent) return state_.heard + patience();
  if (state_.phase != Phase::waiting) return state_.heard + kSilent;
  if (!starts_) return Instant::max();
  return first_ ? Instant() : state_.next_start.value_or(Instant::max());
}

void LinkKeeper::Started(Instant now) {
  first_ = state_.opened = false;
  started_ = now;
  state_.phase = LinkState::Phase::starting;
  state_.heard = now;
  state_.next_start.reset();
}

void LinkKeeper::Opened(Instant now) {
  state_.opened = true;
  state_.phase = LinkState::Phase::up;
  state_.heard = now;
}

void LinkKeeper::Counted(const LinkCounts& counts, Instant now) {
  state_.heard = now;
  state_.phase = state_.opened ? LinkState::Phase::up : LinkState::Phase::starting;
  state_.subscribers = counts.subscribers;
  state_.written = before_.written + counts.written;
  state_.refused = before_.refused + counts.refused;
  state_.requests_dropped = before_.dropped + counts.dropped;
  state_.events_skipped = before_.events_dropped + counts.events_dropped;
  state_.datagrams = counts.datagrams;
  state_.datagrams.AddEarlier(before_.datagrams);
  state_.remarks = counts.neighbours.remarks;
  reached_ = counts.neighbours.reached;
  if (now - started_ >= kYoung) return;
  for (const config::HostPort& at : before_.neighbours.reached) {
    if (reached_.size() == Neighbours::kMostReached) break;
    if (std::ranges::find(reached_, at) == reached_.end()) reached_.push_back(at);
  }
}

void LinkKeeper::Ended(std::string reason, Instant now) {
  first_ = false;
  if (state_.opened) ++state_.times_lost;
  if (state_.opened && now - started_ >= kLongLife) rung_ = 0;
  if (starts_) state_.next_start = now + kLadder[rung_];
  rung_ = std::min(rung_ + 1, kLadder.size() - 1);
  state_.opened = false;
  state_.phase = LinkState::Phase::waiting;
  state_.reason = std::move(reason);
  state_.subscribers = {};
  state_.datagrams.participants = 0;
  state_.remarks.clear();
  before_ = {.subscribers = {},
             .written = state_.written,
             .refused = state_.refused,
             .dropped = state_.requests_dropped,
             .events_dropped = state_.events_skipped,
             .datagrams = state_.datagrams,
             .neighbours = {.reached = reached_, .remarks = {}}};
}

namespace {

// The longest time from `end` to the end of the process: it publishes the final samples, waits 400
// ms for acknowledgement, gives subscribers 150 ms to take the samples, and deletes its
// participant.
constexpr Duration kGoodbye = kEndTime + 550ms;
constexpr Duration kRoomPause = 5ms;

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
    // If the process has closed the socket, ProcessLink notices it when it reads the socket, and
    // calls Detach.
    case PacketSent::closed:
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

namespace {

// Longest time from the end of the link to the end of the process.
constexpr Duration kReapTime = 300ms;
constexpr int kMostPacketsAtOnce = 100;
constexpr std::size_t kMostTold = 100;
// The greatest possible age of a request, far longer than any deadline: a wrong `received` must not
// overflow.
constexpr Duration kOldest = 1h;

Instant Clock() { return ReadClocks().instant; }

bool MayConnect(unsigned user, const std::string& expected) {
  if (user == 0 || user == ::geteuid()) return true;
  const struct ::passwd* entry = ::getpwnam(expected.c_str());
  return entry != nullptr && entry->pw_uid == user;
}

}  // namespace

Result<std::unique_ptr<ProcessLink>> ProcessLink::Create(ProcessLinkOptions options, Log log) {
  std::unique_ptr<ProcessLink> link(new ProcessLink(std::move(options), std::move(log)));
  if (!link->options_.socket.empty()) {
    auto listener = ListenAt(link->options_.socket, link->options_.socket_group);
    if (!listener) return Error{"dds: " + listener.error()};
    link->listener_ = std::move(*listener);
  }
  link->worker_.Start();
  return link;
}

ProcessLink::ProcessLink(ProcessLinkOptions options, Log log)
    : options_(std::move(options)),
      log_(std::move(log)),
      writer_(std::make_shared<LinkWriter>(options_.open)),
      keeper_(options_.socket.empty()),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      worker_("dds link", [this](bool last) { return Round(last); }) {}

ProcessLink::~ProcessLink() {
  Stop();
  if (listener_) ::unlink(options_.socket.c_str());
}

void ProcessLink::Stop() {
  worker_.RequestStop();
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(wake_.get(), &one, sizeof one);
  worker_.Stop();
}

LinkState ProcessLink::state() const {
  const MutexLock lock(mutex_);
  return shown_;
}

Instant ProcessLink::Round(bool last) {
  if (!last) {
    const LinkState before = keeper_.state();
    Act(Clock());
    Publish(before);
    Wait();
    // Round must be called again immediately.
    return {};
  }
  writer_->Detach();
  socket_.Close();
  if (child_) child_->Reap(kReapTime);
  child_.reset();
  return kWhenWoken;
}

void ProcessLink::Act(Instant now) {
  if (child_) PassOutput(now);
  if (socket_) Listen(now);
  if (!socket_ && writer_->ending()) return;
  switch (keeper_.Look(now)) {
    case LinkKeeper::Wish::start:
      Start(now);
      break;
    case LinkKeeper::Wish::give_up:
      End((keeper_.state().opened ? "read no messages of the gateway for "
                                  : "did not open DDS within ") +
              FormatDuration(keeper_.patience()),
          now);
      break;
    case LinkKeeper::Wish::nothing:
      if (listener_ && !socket_) Welcome(now);
      break;
  }
}

void ProcessLink::Start(Instant now) {
  const auto program =
      options_.program.empty() ? FindProgram("baudgate-dds") : Result(options_.program);
  if (!program) {
    return keeper_.Ended("cannot be started: " + program.error() + "; install baudgate-dds", now);
  }
  auto ends = MakePacketPair();
  if (!ends) return keeper_.Ended("cannot be started: " + ends.error(), now);
  auto child =
      ChildProcess::Start(*program,
                          {"--link", std::to_string(kLinkDescriptor), "--parent",
                           std::to_string(::getpid()), "--memory", std::to_string(options_.memory)},
                          ends->second);
  if (!child) return keeper_.Ended("cannot be started: " + child.error(), now);
  child_ = std::move(*child);
  Talk(std::move(ends->first), now);
}

void ProcessLink::Welcome(Instant now) {
  auto peer = AcceptPeer(listener_.get());
  if (!peer) return;
  const std::string who =
      "process " + std::to_string(peer->process) + " of user " + std::to_string(peer->user);
  if (!MayConnect(peer->user, options_.socket_user)) {
    return Tell(log::Level::warning, who + " may not connect to " + options_.socket);
  }
  Tell(log::Level::info, who + " has connected");
  Talk(std::move(peer->socket), now);
}

void ProcessLink::Talk(Descriptor socket, Instant now) {
  socket_ = std::move(socket);
  keeper_.Started(now);
  LinkOpen open = writer_->open();
  open.participant.reached = keeper_.reached();
  // Cannot fail: an empty socket has space for one packet.
  SendPacket(socket_.get(), EncodeOpen(open));
}

void ProcessLink::Listen(Instant now) {
  for (int i = 0; i < kMostPacketsAtOnce; ++i) {
    const ReceivedPacket received = ReceivePacket(socket_.get(), *buffer_);
    if (received.got == PacketGot::nothing_yet) return;
    if (received.got == PacketGot::closed) return End("closed the link", now);
    if (const Status status = Understand(received.packet, now); !status) {
      return End(status.error(), now);
    }
  }
}

Status ProcessLink::Understand(View packet, Instant now) {
  const auto message = ParseLink(packet);
  if (!message) return Error{"sent " + message.error()};
  switch (message->kind) {
    case LinkKind::opened:
      keeper_.Opened(now);
      writer_->Attach(socket_.get());
      return {};
    case LinkKind::failed:
      return Error{"did not start: " + DecodeFailed(message->body)};
    case LinkKind::counts: {
      const auto counts = DecodeCounts(message->body);
      if (!counts) return Error{"sent " + counts.error()};
      keeper_.Counted(*counts, now);
      writer_->SetSubscribers(counts->subscribers);
      return {};
    }
    case LinkKind::left:
      writer_->SetLeft();
      return {};
    case LinkKind::request: {
      if (!options_.open.requests)
        return Error{"sent a write request, although writing is not permitted"};
      auto arrival = DecodeRequest(message->body);
      if (!arrival) return Error{"sent " + arrival.error()};
      arrival->received = std::clamp(arrival->received, now - kOldest, now);
      writer_->HandOn(std::move(*arrival));
      return {};
    }
    default:
      return Error{"sent a message of an unexpected kind"};
  }
}

void ProcessLink::PassOutput(Instant now) {
  std::array<char, 4096> bytes;
  for (;;) {
    const ssize_t count = ::read(child_->output(), bytes.data(), bytes.size());
    if (count == 0) child_->CloseOutput();
    if (count <= 0) return;
    const std::string_view text(bytes.data(), static_cast<std::size_t>(count));
    for (const std::string& line : output_.Add(text, now)) {
      Tell(log::Level::warning, "process: " + line);
    }
  }
}

void ProcessLink::End(std::string reason, Instant now) {
  writer_->Detach();
  socket_.Close();
  if (child_) {
    // How the child ended is the reason only if the child has closed the link itself.
    const bool by_itself = reason == "closed the link";
    const std::string end = child_->Reap(by_itself ? kReapTime : Duration::zero());
    PassOutput(now);
    child_.reset();
    if (by_itself) reason = end;
  }
  keeper_.Ended(std::move(reason), now);
}

void ProcessLink::Publish(const LinkState& before) {
  using Phase = LinkState::Phase;
  const LinkState& state = keeper_.state();
  {
    const MutexLock lock(mutex_);
    shown_ = state;
  }
  if (writer_->ending()) return;
  if (state.refused > before.refused) {
    Tell(log::Level::warning,
         "DDS has refused samples; the gateway sends the latest values again with the next "
         "heartbeat");
  }
  for (const std::string& remark : state.remarks) {
    if (told_.size() < kMostTold && told_.insert(remark).second) {
      Tell(log::Level::warning, remark);
    }
  }
  if (state.phase == before.phase && state.times_lost == before.times_lost &&
      state.reason == before.reason) {
    return;
  }
  switch (state.phase) {
    case Phase::up:
      Tell(log::Level::info, before.phase == Phase::silent ? "the process reads samples again"
                                                           : "the process accepts samples");
      break;
    case Phase::silent:
      Tell(
          log::Level::warning,
          "the process does not read the samples of the gateway, so subscribers get no new values");
      break;
    // The line omits the time until the restart, so that the log can fold repeated lines.
    case Phase::waiting:
      Tell(log::Level::warning, "the process " + state.reason +
                                    (state.next_start ? "; the gateway starts it again" : ""));
      break;
    case Phase::starting:
      break;
  }
}

void ProcessLink::Wait() {
  std::array<pollfd, 4> waited{{{wake_.get(), POLLIN, 0},
                                {socket_.get(), POLLIN, 0},
                                {child_ ? child_->output() : -1, POLLIN, 0},
                                {socket_ ? -1 : listener_.get(), POLLIN, 0}}};
  const Instant next = keeper_.NextLook();
  int timeout = -1;
  if (next != Instant::max() && !(writer_->ending() && !socket_)) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(next - Clock());
    timeout = static_cast<int>(std::clamp<std::int64_t>(left.count(), 0, 60'000));
  }
  ::poll(waited.data(), waited.size(), timeout);
}

}  // namespace baudgate::dds
