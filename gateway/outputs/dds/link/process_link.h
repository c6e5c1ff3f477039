// The daemon's end of the link: a thread that has a process for DDS started (or waits for the one
// that systemd starts), listens to it, and lets the publisher's samples go to it while it is there.
// Lines and Modbus never wait for it. LinkKeeper decides when the process is started, and
// LinkWriter sends the samples.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <condition_variable>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "gateway/base/guarded.h"
#include "gateway/base/log.h"
#include "gateway/base/worker.h"
#include "gateway/outputs/dds/link/child_process.h"
#include "gateway/outputs/dds/link/link_message.h"
#include "gateway/outputs/dds/link/link_state.h"
#include "gateway/outputs/dds/link/packet_socket.h"
#include "gateway/outputs/dds/sample_writer.h"

namespace baudgate::dds {

// Decides when the process that speaks DDS is started, taken for silent, given up and started
// again. Pure: what happened and the time come in; ProcessLink acts on it.
class LinkKeeper {
 public:
  enum class Wish {
    nothing,
    start,    ///< a process, then say Started
    give_up,  ///< end the link, then say Ended
  };
  /// After this time without a sign of life `status` says so; after the second time the process is
  /// restarted.
  static constexpr Duration kSilent = 2s;
  static constexpr Duration kGivenUp = 10s;
  static constexpr Duration kOpening = 1min;
  /// A process of this age has met every subscriber that is there.
  static constexpr Duration kYoung = 15s;

  /// `starts`: we start the process (the first time at once, then 0.1, 0.5, 1, 2, 5, 10 s after
  /// each end, and from the beginning again after a minute of life); otherwise somebody else does.
  explicit LinkKeeper(bool starts) : starts_(starts) {}

  Wish Look(Instant now);
  /// When to look again, if nothing happens.
  Instant NextLook() const;

  void Started(Instant now);
  /// It said that samples may come.
  void Opened(Instant now);
  /// A sign of life.
  void Counted(const LinkCounts& counts, Instant now);
  /// `reason` goes on "it …": "it was ended by signal 6".
  void Ended(std::string reason, Instant now);

  const LinkState& state() const { return state_; }
  /// Where the next process asks for subscribers: the addresses that this process has reached, and
  /// while it is young, those that the process before it had reached.
  const std::vector<config::HostPort>& reached() const { return reached_; }
  /// How long its silence may last now.
  Duration patience() const { return state_.opened ? kGivenUp : kOpening; }

 private:
  const bool starts_;
  LinkState state_;
  bool first_ = true;
  Instant started_{};
  std::size_t rung_ = 0;  ///< of the ladder: the next wait
  LinkCounts before_;     ///< by processes that have ended
  std::vector<config::HostPort> reached_;
};

// The SampleWriter that sends samples to the process that speaks DDS. It never waits and keeps
// empty: what does not fit into the socket now is wanted later.

/// The publisher's thread writes; ProcessLink attaches and detaches processes from its own.
class LinkWriter : public SampleWriter {
 public:
  explicit LinkWriter(LinkOpen open = {}) : open_(std::move(open)) {}

  Sent Write(const PointSample& sample) override;
  Sent Write(const DeviceSample& sample) override;
  Sent Write(const GatewaySample& sample) override;
  Sent Write(const EventSample& sample) override;
  Sent Write(const AlarmSample& sample) override;
  Sent Write(const ReplySample& reply) override;
  /// Tells the process that this is the end, and waits until it has left: longer by what it needs
  /// for the ends of the points and for its own goodbye.
  bool WaitAcknowledged(Duration most) override;
  Sent Reopen(const Room& room) override;
  Subscribers subscribers() const override;
  std::uint64_t session() const override;
  void OnSession(const std::function<void()>& changed) override;
  void OnRequest(TakeRequest take) override;

  /// The request to open that the next process gets, with the room of the latest Reopen.
  LinkOpen open() const;
  /// Sends samples to `socket` from now on; the caller keeps it open until Detach. A second call
  /// with the same socket means that the process has replaced its writers.
  void Attach(int socket);
  void Detach();
  void SetSubscribers(const Subscribers& subscribers);
  /// The process has left, and subscribers have everything.
  void SetLeft();
  /// From the process.
  void HandOn(WriteArrival arrival) const;
  /// The end has been told.
  bool ending() const;

 private:
  template <typename Sample>
  Sent Put(LinkKind kind, const Sample& sample);
  Sent SendHeld(std::size_t size) BAUDGATE_REQUIRES(mutex_);
  void TellSession() const;

  mutable Mutex mutex_;
  LinkOpen open_ BAUDGATE_GUARDED_BY(mutex_);
  std::condition_variable detached_;
  int socket_ BAUDGATE_GUARDED_BY(mutex_) = -1;
  std::uint64_t sessions_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  Subscribers subscribers_ BAUDGATE_GUARDED_BY(mutex_);
  bool ending_ BAUDGATE_GUARDED_BY(mutex_) = false;
  bool left_ BAUDGATE_GUARDED_BY(mutex_) = false;
  /// The process was asked to replace its writers and has not answered yet. Nothing is sent
  /// meanwhile, because the order of events would change: the oldest ones are sent again
  /// afterwards.
  bool reopening_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::array<std::uint8_t, kMaxLinkMessage> packet_ BAUDGATE_GUARDED_BY(mutex_){};
  mutable Mutex telling_;
  std::function<void()> on_session_ BAUDGATE_GUARDED_BY(telling_);
  TakeRequest on_request_ BAUDGATE_GUARDED_BY(telling_);
};

struct ProcessLinkOptions {
  LinkOpen open;
  std::string program;  ///< empty: baudgate-dds, where FindProgram finds it
  /// Not empty: no process is started, but awaited at this socket.
  std::string socket;
  /// The group that may connect, and the user that may beside root and our own.
  std::string socket_group = "baudgate-dds";
  std::string socket_user = "baudgate-dds";
  std::uint64_t memory = 1ULL << 30;  ///< address space of a process that we start, in bytes
};

class ProcessLink {
 public:
  /// Called on the link's thread, at a change.
  using Log = std::function<void(log::Level level, const std::string& line)>;

  /// The error says why the socket cannot be had. A program that is missing is a state: the
  /// gateway runs without.
  static Result<std::unique_ptr<ProcessLink>> Create(ProcessLinkOptions options, Log log);
  ~ProcessLink();  ///< as Stop

  /// The writer for a publisher. It may outlive the link; then it has no receiver.
  std::shared_ptr<LinkWriter> writer() const { return writer_; }
  LinkState state() const;
  /// Ends process and thread within half a second. After the publisher's. Idempotent.
  void Stop();

 private:
  ProcessLink(ProcessLinkOptions options, Log log);

  Instant Round(bool last);
  void Act(Instant now);
  void Start(Instant now);
  void Welcome(Instant now);
  void Talk(Descriptor socket, Instant now);
  void Listen(Instant now);
  Status Understand(View packet, Instant now);
  void PassOutput(Instant now);
  void End(std::string reason, Instant now);
  /// For packets, output, a peer, the time of the keeper, or Stop.
  void Wait();
  void Publish(const LinkState& before);
  void Tell(log::Level level, const std::string& line) const {
    if (log_) log_(level, line);
  }

  const ProcessLinkOptions options_;
  const Log log_;
  const std::shared_ptr<LinkWriter> writer_;
  LinkKeeper keeper_;
  Descriptor wake_;
  Descriptor listener_;
  Descriptor socket_;
  std::optional<ChildProcess> child_;
  BoundedLines output_;
  std::set<std::string> told_;  // remarks; no more than kMostTold, as strangers cause them
  std::unique_ptr<PacketBuffer> buffer_ = std::make_unique<PacketBuffer>();

  mutable Mutex mutex_;
  LinkState shown_ BAUDGATE_GUARDED_BY(mutex_);
  Worker worker_;
};

}  // namespace baudgate::dds
