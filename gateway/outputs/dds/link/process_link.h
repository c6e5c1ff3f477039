// `ProcessLink` is the gateway's side of the link: a thread that starts baudgate-dds (or waits
// until the baudgate-dds that systemd starts connects) and receives its messages. Lines and Modbus
// never wait for it. LinkKeeper decides when the process is started and given up, and LinkWriter
// sends samples to it.
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

// LinkKeeper decides when baudgate-dds is started, reported as silent, given up and started again.
// No I/O, no clock: the caller passes events and the time.
class LinkKeeper {
 public:
  enum class Wish {
    nothing,
    start,    ///< the caller must start a process, then call Started
    give_up,  ///< the caller must close the link, then call Ended
  };
  /// Times since the last message of the process: after kSilent, `status` reports it as silent;
  /// after kGivenUp, it is given up and restarted. While it has not opened DDS yet, kOpening
  /// replaces kGivenUp.
  static constexpr Duration kSilent = 2s;
  static constexpr Duration kGivenUp = 10s;
  static constexpr Duration kOpening = 1min;
  /// A process that has run for this time has found all running subscribers.
  static constexpr Duration kYoung = 15s;

  /// `starts` true: the gateway starts the process. The first start is immediate; after the process
  /// has ended, the next start is 0.1, 0.5, 1, 2, 5, 10, 10 … s later. If the process has opened
  /// DDS and run for a minute, the next start is 0.1 s later. `starts` false: another program
  /// starts the process.
  explicit LinkKeeper(bool starts) : starts_(starts) {}

  Wish Look(Instant now);
  /// Returns when to call Look again if nothing happens.
  Instant NextLook() const;

  void Started(Instant now);
  void Opened(Instant now);
  void Counted(const LinkCounts& counts, Instant now);
  /// To be called when the process has ended. `reason` completes "the process …", e.g. "was ended
  /// by signal 6".
  void Ended(std::string reason, Instant now);

  const LinkState& state() const { return state_; }
  /// Returns the addresses at which the next process looks for subscribers: those that the present
  /// process has matched and, while it is younger than kYoung, those of the process before.
  const std::vector<config::HostPort>& reached() const { return reached_; }
  /// Returns the time without messages after which the process is given up.
  Duration patience() const { return state_.opened ? kGivenUp : kOpening; }

 private:
  const bool starts_;
  LinkState state_;
  bool first_ = true;
  Instant started_{};
  std::size_t rung_ = 0;  ///< index of the next waiting time in kLadder
  LinkCounts before_;     ///< sums of the counts of the processes that have ended
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
  /// Sends `end`, and waits until the process has ended. The wait can exceed `most`, because the
  /// process first publishes the final samples.
  bool WaitAcknowledged(Duration most) override;
  Sent Reopen(const Room& room) override;
  Subscribers subscribers() const override;
  std::uint64_t session() const override;
  void OnSession(const std::function<void()>& changed) override;
  void OnRequest(TakeRequest take) override;

  /// Returns the message `open` for the next process, with the Room of the latest call of Reopen.
  LinkOpen open() const;
  /// Sends samples to `socket` from now on; the caller keeps it open until Detach. A second call
  /// with the same socket means that the process has replaced its writers.
  void Attach(int socket);
  void Detach();
  void SetSubscribers(const Subscribers& subscribers);
  /// To be called when subscribers have acknowledged everything and the process exits.
  void SetLeft();
  void HandOn(WriteArrival arrival) const;
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
  /// True while the process replaces its writers and has not answered yet. Nothing is sent
  /// meanwhile: after the answer the publisher sends old events again, so an event that is sent now
  /// would arrive out of order.
  bool reopening_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::array<std::uint8_t, kMaxLinkMessage> packet_ BAUDGATE_GUARDED_BY(mutex_){};
  mutable Mutex telling_;
  std::function<void()> on_session_ BAUDGATE_GUARDED_BY(telling_);
  TakeRequest on_request_ BAUDGATE_GUARDED_BY(telling_);
};

struct ProcessLinkOptions {
  LinkOpen open;
  /// Path of the program; empty: the path of baudgate-dds that FindProgram returns.
  std::string program;
  /// Path of a socket to which baudgate-dds must connect; no process is started. Empty: the gateway
  /// starts the process.
  std::string socket;
  /// The group that can open the socket, and the user that is accepted besides root and the
  /// gateway's user.
  std::string socket_group = "baudgate-dds";
  std::string socket_user = "baudgate-dds";
  /// Limit of the address space of a process that the gateway starts, in bytes.
  std::uint64_t memory = 1ULL << 30;
};

class ProcessLink {
 public:
  /// Takes a log line when something changes, on the link's thread.
  using Log = std::function<void(log::Level level, const std::string& line)>;

  /// Returns an error if the socket cannot be opened. A missing program is not an error: the
  /// gateway runs without it, and state() reports it.
  static Result<std::unique_ptr<ProcessLink>> Create(ProcessLinkOptions options, Log log);
  ~ProcessLink();

  /// Returns the writer. It can outlive the link; its samples then reach nobody.
  std::shared_ptr<LinkWriter> writer() const { return writer_; }
  LinkState state() const;
  /// Ends the process and the thread within half a second. To be called after the publisher's Stop.
  /// A second call does nothing.
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
  // Remarks that were logged; at most kMostTold, because strangers can cause remarks.
  std::set<std::string> told_;
  std::unique_ptr<PacketBuffer> buffer_ = std::make_unique<PacketBuffer>();

  mutable Mutex mutex_;
  LinkState shown_ BAUDGATE_GUARDED_BY(mutex_);
  Worker worker_;
};

}  // namespace baudgate::dds
