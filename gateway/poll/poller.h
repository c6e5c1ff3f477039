// Runs one line: chooses what to ask (commands, polls, probes), hands requests to the line
// discipline, frames to conversations, readings to the point store, and decides about retries and
// dead devices. Sans-I/O like gateway/line/line.h: bytes and time come in as arguments. One thread
// at a time.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/model/line.h"
#include "config/model/listener.h"
#include "gateway/line/echo_watch.h"
#include "gateway/line/line.h"
#include "gateway/poll/answer_order.h"
#include "gateway/poll/device_health.h"
#include "gateway/poll/probe_budget.h"
#include "gateway/poll/schedule.h"
#include "gateway/poll/turns.h"
#include "gateway/poll/write_queue.h"
#include "gateway/requests/commands.h"
#include "gateway/requests/route_queue.h"
#include "gateway/requests/routed.h"
#include "gateway/store/line_status.h"
#include "gateway/store/point_store.h"
#include "gateway/trace/tap.h"
#include "protocols/protocol.h"

namespace baudgate {

/// What a line's owner hears from its poller.
class PollerListener {
 public:
  virtual ~PollerListener() = default;
  /// A whole request, to be sent at once with these settings of the port.
  virtual void Send(View bytes, const config::SerialSettings& serial) = 0;
  /// No good reply came: what of the request has not left this machine must not leave it later.
  virtual void OnNoReply() {}
  /// One line per change, with the reason; `device` is numbered as for gateway/trace/tap.h.
  virtual void OnDeviceState(std::uint32_t device, DeviceState from, DeviceState to,
                             const std::string& reason) = 0;
  /// Something the user should know that is not a state: an echo suspected, a late device.
  virtual void OnWarning(std::uint32_t device, const std::string& message) = 0;
};

class Poller : private LineClient {
 public:
  /// `first_device`: the index of line.devices[0] in the store. `find` names the descriptor of a
  /// protocol that the configuration has checked to exist. All references outlive the poller.
  using FindProtocol = std::function<const Protocol&(const std::string& name)>;
  Poller(const config::Line& line, std::uint32_t first_device, const FindProtocol& find,
         PointStore& store, PollerListener& listener);
  ~Poller() override;

  /// Before anything else; `tap` outlives the poller.
  void Attach(Tap& tap) { tap_ = &tap; }

  /// `keeps_bit_rate`: see Line::OnOpened.
  void OnOpened(Now now, bool keeps_bit_rate = false);
  void OnClosed(Now now);
  /// The port was closed because it has been lent to another program: points are out of service.
  void OnReleased(Now now);
  /// `device` is an index in the point store. Not in use: not asked, its points out of service.
  void SetInUse(std::uint32_t device, bool in_use, Now now);
  void OnBytes(View bytes, Now now);
  void OnTimer(Now now);
  std::optional<Instant> Deadline() const;

  /// Takes the command, or says no when kQueueLimit are waiting. Commands for an offline device, or
  /// on a closed line, are answered at once: nothing is sent late.
  bool Submit(WriteCommand command, Now now);
  static constexpr std::size_t kQueueLimit = WriteQueue::kLimit;
  /// A start or stop that a client sends to a slave that does not answer is tried at a share of its
  /// own: a slave that has returned has to obey before the probes have found it.
  static constexpr double kWriteShare = 0.1;

  /// Takes a request of a transparent route; the caller keeps to RouteQueue::kLimit. On a closed
  /// line, and for a slave that does not answer, it may be answered at once.
  void Submit(RoutedRequest request, Now now);
  /// The client has left. Says how many of its requests will not be answered.
  std::size_t Forget(std::uint64_t client, Now now);

  /// Nothing is begun any more until the port opens again: the write under way may end.
  void WindUp() { winding_up_ = true; }
  bool IsWriting() const;

  const LineCounters& counters() const { return counters_; }
  /// What was asked since `when` has remained without an answer: a serial server may hang although
  /// its TCP lives.
  bool SilentSince(Instant when) const {
    return silent_from_ && *silent_from_ < when && last_failure_ >= when;
  }

 private:
  struct Device;  // gateway/poll/poller_parts.h
  struct Work;

  Outcome Judge(View frame, Instant now) override;
  void Hear(LineNews news);
  void Send();
  void OnEnd(ExchangeEnd end);
  void OnStray(const StrayBytes& stray);
  void OnSecondReply();

  void Advance(Now now);
  void Close(Now now, Override why);
  std::string WhyClosed() const;
  void Settle();
  void ExpireCommands();
  void Pump();
  bool PickTask();
  bool PickUrgent();
  bool PickWriteProbe();
  Instant NextWriteProbe(const Device& device) const;
  bool Pick(Turns::Choice choice);
  Turns::Waiting Waiting() const;
  Device& DeviceOf(const WriteCommand& command) const;
  bool PickCommand();
  bool PickParked();
  bool PickRefresh();
  bool PickPoll();
  bool PickProbe();
  bool PickRouted(config::Priority priority);
  bool StartRouted(RouteQueue::Batch batch);
  bool MayAsk(const RoutedRequest& request) const;
  bool MayCommand(const WriteCommand& command) const;
  bool IsGivenUp(const Device& device) const;
  void ChargeFailure(const Work& work);
  bool IsDoubted(const Device& device) const;
  bool IsUrgent(const Work& work) const;
  void DoubtReadings();
  void CancelQuiet();
  bool MayStillAnswer(const Work& work, const ExchangeEnd& end) const;
  Instant AnswersEnd(const Work& work) const;
  Instant AnswerDue(const Work& work) const;

  void AddSlave(Device& device);
  Device& SlaveAt(std::uint8_t slave);
  Device* FindSlave(std::uint8_t slave) const;
  bool Wanted(const Device& device) const;
  bool MayRepeatRead(const Device& device) const;
  bool RepeatRead(const Device& device);
  void AnswerForAbsent();
  void AnswerExpired();
  Outcome OnRoutedFrame(View frame);
  void OnRoutedFailure(const ExchangeEnd& end);
  void FinishRouted(Work& work, Outcome outcome, const std::string& reason);
  std::optional<Instant> NextWanted() const;
  bool RoutedWaits() const;
  std::optional<Instant> LatestStart(const Work& work) const;
  void ChangeStatus(const Device& device, const std::function<void(DeviceStatus&)>& change);
  void BeginTask(Device& device, Task task);
  void Ask();
  void ConcludeExchange();
  void OnAnswered();
  void OnFailed();
  void EndInFailure(const ExchangeEnd& end);
  bool HasOverstayed(const Work& work) const;
  void FinishTask(Outcome outcome, const std::string& reason);
  bool LooksLikeProbe(View frame);
  void ForgetSilentIdentity(Device& device, Outcome outcome);
  AnswerOrder::Fingerprint ProbeOf(const Device& device) const;
  AnswerOrder::Fingerprint FingerprintOf(const Request& request) const;
  bool MayBeInStep(const Work& work) const;
  bool IsSafe(const Work& work) const;
  bool NeedsSync() const;
  void Synchronize();
  void ResumePostponed(Outcome outcome, const std::string& reason);
  void NextWrite();
  bool IsOnce(const Work& work) const;
  void RepeatOnce(Device& device, Outcome outcome);
  void UpdateHealth(Device& device, Outcome outcome, const std::string& reason);
  void ShowState(Device& device, const std::string& reason);
  void MeasureRound(const Work& work, Outcome outcome);
  void MeasureCycle();
  void AnswerConfirmed();
  void CountExchange(Device& device);
  void CountMissed();
  void CountLate(Device& device, Duration since_end);
  void ShowLine();
  double UseSince(Instant began) const;
  Duration NoticeBound() const;
  void Reconnect(Device& device);
  void Plan(Device& device);
  void Store(Device& device);
  void ShowOverride(const Device& device);
  Override OverrideOf(const Device& device) const;
  DeviceState StateOf(const Device& device) const;
  std::optional<Instant> NextProbe() const;
  std::optional<Instant> NextClear() const;
  Device* Absent(std::size_t turn) const;
  Duration Waited(Instant from, Instant to) const;
  Duration Aftermath(const Work& work) const;
  Duration OlderAnswers(const Device& device) const;
  Instant ClearAt(const Work& work) const;
  bool IsTooLate(const Work& work) const;
  const char* WhyNot(const Work& work) const;
  void BreakOff(const std::string& why);
  void Recognise(Device& device, const Bytes& sender);
  void SetLate(const Device& device, Instant until);
  void HoldBack(const Device& device);
  void AwaitOlderAnswers();
  void ChargeProbe();

  const config::Line& config_;
  PointStore& store_;
  PollerListener& listener_;
  Tap* tap_ = nullptr;
  const std::uint32_t line_index_;
  Line line_;
  EchoWatch echo_;
  Turns turns_;
  WriteQueue writes_;
  Schedule schedule_;
  ProbeBudget probes_;
  ProbeBudget write_probes_{kWriteShare};  // short writes to slaves that do not answer
  std::vector<std::unique_ptr<Bus>> buses_;
  std::vector<std::unique_ptr<Device>> devices_;
  const Protocol* carrier_ = nullptr;  // of the line, when it carries Modbus
  // By address: devices above that routes reach too, and slaves that only routes reach.
  std::map<std::uint8_t, Device*> slaves_;
  std::vector<Device*> everyone_;  // devices, then the other slaves
  std::vector<std::unique_ptr<Device>> routed_slaves_;
  RouteQueue routes_;
  std::unique_ptr<Work> work_;       // the task under way
  std::unique_ptr<Work> postponed_;  // until its device is in sync again
  AnswerOrder order_;                // of all requests, whoever they went to
  Device* last_ = nullptr;           // whose exchange ended last
  /// The probe that the line is not idle again after.
  struct Probe {
    Device* device = nullptr;
    ProbeBudget* budget = nullptr;
    Instant began{};
  };
  Probe probe_;
  std::size_t probe_turn_ = 0;
  bool open_ = false;
  bool winding_up_ = false;
  Override closed_as_ = Override::not_connected;  // of all points while not open
  bool was_idle_ = false;  // the line, before the input that is being handled
  Instant idle_since_{};   // when it last became so
  Instant minute_began_{};
  Duration busy_before_minute_{};
  std::optional<double> use_;  // of the last full minute; nothing before there is one
  Now now_{};                  // of the input that is being handled
  // The last queries stored since the line last rested for one reply time: doubted when a second,
  // different reply appears.
  std::vector<QueryRef> unproven_;
  std::optional<Instant> silent_from_;  // nobody has answered since
  Instant last_failure_{};              // of an exchange
  std::optional<Instant> routed_at_;    // end of the last routed exchange that was answered
  LineCounters counters_;
};

}  // namespace baudgate
