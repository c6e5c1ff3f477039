// `ProcessLink` is the gateway's side of the link: a thread that starts baudgate-dds (or waits for
// the one that systemd starts) and receives its messages. Lines and Modbus never wait for it.
// LinkKeeper decides when the process is started and given up, and LinkWriter sends samples to it.
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

// Decides when baudgate-dds is started, reported as silent, given up and started again. No I/O:
// what happened and the time are arguments.
class LinkKeeper {
 public:
  enum class Wish {
    nothing,
    start,    ///< start a process, then call Started
    give_up,  ///< end the link, then call Ended
  };
  /// Since the last message of the process: after kSilent `status` reports it as silent; after
  /// kGivenUp it is restarted, or after kOpening if it has not opened DDS yet.
  static constexpr Duration kSilent = 2s;
  static constexpr Duration kGivenUp = 10s;
  static constexpr Duration kOpening = 1min;
  /// A process of this age has met all running subscribers.
  static constexpr Duration kYoung = 15s;

  /// `starts`: we start the process, the first time at once, then 0.1, 0.5, 1, 2, 5, 10, 10 … s
  /// after each end, and from 0.1 s again after a minute of life. Otherwise another program starts
  /// it.
  explicit LinkKeeper(bool starts) : starts_(starts) {}

  Wish Look(Instant now);
  /// Returns when to call Look again if nothing happens.
  Instant NextLook() const;

  void Started(Instant now);
  /// The process is ready for samples.
  void Opened(Instant now);
  /// The process has sent counts, so it is alive.
  void Counted(const LinkCounts& counts, Instant now);
  /// `reason` continues "it …", e.g. "was ended by signal 6".
  void Ended(std::string reason, Instant now);

  const LinkState& state() const { return state_; }
  /// Where the next process looks for subscribers: the addresses that the present process has
  /// matched and, while it is younger than kYoung, those of the process before.
  const std::vector<config::HostPort>& reached() const { return reached_; }
  /// How long the process may be silent now.
  Duration patience() const { return state_.opened ? kGivenUp : kOpening; }

 private:
  const bool starts_;
  LinkState state_;
  bool first_ = true;
  Instant started_{};
  std::size_t rung_ = 0;  ///< index of the next wait in kLadder
  LinkCounts before_;     ///< sums of the processes that have ended
  std::vector<config::HostPort> reached_;
};

/// `LinkWriter` sends samples to baudgate-dds. It never waits and has no queue: if the socket is
/// full, Write returns `later`, and the caller sends the latest value later. The publisher's thread
/// calls Write; the thread of ProcessLink calls Attach and Detach.
class LinkWriter : public SampleWriter {
 public:
  explicit LinkWriter(LinkOpen open = {}) : open_(std::move(open)) {}

  Sent Write(const PointSample& sample) override;
  Sent Write(const DeviceSample& sample) override;
  Sent Write(const GatewaySample& sample) override;
  Sent Write(const EventSample& sample) override;
  Sent Write(const AlarmSample& sample) override;
  Sent Write(const ReplySample& reply) override;
  /// Sends `end`, and waits until the process has ended, which takes longer than `most`: the
  /// process publishes the final samples and leaves.
  bool WaitAcknowledged(Duration most) override;
  Sent Reopen(const Room& room) override;
  Subscribers subscribers() const override;
  std::uint64_t session() const override;
  void OnSession(const std::function<void()>& changed) override;
  void OnRequest(TakeRequest take) override;

  /// Returns the message `open` for the next process, with the room of the latest Reopen.
  LinkOpen open() const;
  /// Sends samples to `socket`, which the caller keeps open until Detach. A second call with the
  /// same socket: the process has replaced its writers.
  void Attach(int socket);
  void Detach();
  void SetSubscribers(const Subscribers& subscribers);
  /// Subscribers have acknowledged everything, and the process leaves.
  void SetLeft();
  void HandOn(WriteArrival arrival) const;
  /// True after WaitAcknowledged was called.
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
  /// meanwhile, because the new session repeats the oldest events, and their order would change.
  bool reopening_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::array<std::uint8_t, kMaxLinkMessage> packet_ BAUDGATE_GUARDED_BY(mutex_){};
  mutable Mutex telling_;
  std::function<void()> on_session_ BAUDGATE_GUARDED_BY(telling_);
  TakeRequest on_request_ BAUDGATE_GUARDED_BY(telling_);
};

struct ProcessLinkOptions {
  LinkOpen open;
  std::string program;  ///< empty: baudgate-dds, at the path of FindProgram
  /// Not empty: no process is started; one must connect to this socket.
  std::string socket;
  /// The group that may open the socket, and the user that is accepted beside root and our own.
  std::string socket_group = "baudgate-dds";
  std::string socket_user = "baudgate-dds";
  std::uint64_t memory = 1ULL << 30;  ///< address space of a process that we start, in bytes
};

class ProcessLink {
 public:
  /// Called on the link's thread, when something changes.
  using Log = std::function<void(log::Level level, const std::string& line)>;

  /// The error is the reason why the socket cannot be opened. A missing program is no error: the
  /// gateway runs without it, and state() shows it.
  static Result<std::unique_ptr<ProcessLink>> Create(ProcessLinkOptions options, Log log);
  ~ProcessLink();  ///< calls Stop

  /// The writer may outlive the link, and then has no receiver.
  std::shared_ptr<LinkWriter> writer() const { return writer_; }
  LinkState state() const;
  /// Ends process and thread within half a second; after the publisher's Stop. Idempotent.
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
  /// Waits for packets, output of the process, a connection, the time of NextLook, or Stop.
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
  // Logged remarks; at most kMostTold, because strangers can cause them.
  std::set<std::string> told_;
  std::unique_ptr<PacketBuffer> buffer_ = std::make_unique<PacketBuffer>();

  mutable Mutex mutex_;
  LinkState shown_ BAUDGATE_GUARDED_BY(mutex_);
  Worker worker_;
};

}  // namespace baudgate::dds
