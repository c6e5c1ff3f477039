// The loan of a line's port to a network client: when the port is handed over, how long the client
// has it, and when the line may go on. A part of gateway/lines/line_runner.h; clients connect at
// gateway/lines/serial_server/server.h.
//
//   free → wanted (the exchange under way ends) → held → rests (until the bus is silent) → free
//
// A client that wants the port during a rest, or soon after, waits: between two loans the line
// polls.
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "config/model/line.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/lines/serial_server/session.h"
#include "gateway/records/audit/audited_writes.h"
#include "transports/transport.h"

namespace baudgate::lines {

/// Where loans are recorded.
struct LoanRecords {
  audit::WriteLog* log = nullptr;  ///< null: nowhere
  bool required = false;           ///< no loan without a record
};

class PortLoan final : public serial_server::PortOwner {
 public:
  /// The line.
  class Line {
   public:
    /// Why its port cannot be lent now, if it cannot.
    virtual std::optional<std::string> WhyNot() const = 0;
    /// Begins nothing more. True: nothing is under way.
    virtual bool Quiet() = 0;
    /// The client has the port until then; `text` names it. Points are out of service.
    virtual void OnLent(const std::string& text, WallTime until, Now now) = 0;
    /// The port is the line's again, with its settings: it goes on.
    virtual void OnReturned(Now now) = 0;
    /// The settings could not be restored.
    virtual void OnPortFailed(const std::string& reason, Now now) = 0;

   protected:
    ~Line() = default;
  };

  struct Links {
    const config::Line& config;
    bus::PointStore& store;
    transports::Transport& port;
    bus::PollerListener& news;
    LoanRecords records{};
    /// Replies to the client may still come after it has left, so the line is silent for this time.
    Duration rest{};
  };
  /// All outlive it.
  PortLoan(const Links& links, Line& line)
      : links_(links), number_(links.store.LineIndex(links.config)), line_(line) {}

  // See PortOwner.
  void Want(serial_server::PortUser& user, const serial_server::Visit& visit, Now now) override;
  void Return(serial_server::PortUser& user, const serial_server::Visit& visit,
              const std::string& why, Now now) override;
  void OnListening(const std::string& place, const std::string& trouble, Now now) override;
  /// The server of the configuration.
  void Serve(const config::PortServer& server) { ShowService(server, std::nullopt); }
  /// The server of `release --tcp`, for this time. Its first client need not wait.
  void Offer(const config::PortServer& server, Duration time, Now now);
  void Withdraw(const config::PortServer& server);

  /// False: the bytes are the line's.
  bool PassToClient(View bytes, Now now);
  void OnRoom();
  /// The port is gone, or is given away: the client is disconnected.
  void OnClosed(const std::string& reason, Now now);
  /// The same, if the port is with this server.
  void TakeBackFrom(serial_server::PortUser& user, const std::string& why, Now now) {
    if (user_ == &user) TakeBack(why, now);
  }
  /// The client is disconnected, and the line goes on.
  void TakeBack(const std::string& why, Now now);
  /// A client has it, or has just left.
  bool has_port() const { return state_ == State::held || state_ == State::rests; }
  /// Which client wants the port, or has it: a sentence.
  std::optional<std::string> InUse() const;
  /// After every input of the line. True: the line waits.
  bool Settle(Now now);
  void OnTimer(Now now);
  std::optional<Instant> Deadline() const;

 private:
  enum class State : std::uint8_t { free, waits, wanted, held, rests };

  bool lends() const { return !links_.config.serial_server.has_value(); }
  Duration TimeOf(const serial_server::Visit& visit, Now now) const;
  void Await(Now now);
  void HandOver(Now now);
  void Refuse(serial_server::PortUser& user, const std::string& client, const std::string& why_not,
              Now now);
  bool Part();
  bool Dismiss(const std::string& why, Now now);
  void Restore(Now now);
  void Tell(const serial_server::Visit& visit, const std::string& why, Now now);
  void ShowVisit(Now now);
  void ShowService(const config::PortServer& server, std::optional<WallTime> until);
  void HideService(const std::string& place);
  bus::PortService* ServiceAt(bus::LineStatus& status, const std::string& place) const;

  const Links links_;
  const std::uint32_t number_;  // in the store, which forgets a line that a reload has ended
  Line& line_;
  State state_ = State::free;
  serial_server::PortUser* user_ = nullptr;  // wants it, or has it
  serial_server::Visit visit_;
  Instant wanted_at_{};
  Instant until_{};
  Instant show_at_{};        // what the status says of it
  std::string offered_at_;   // by `release --tcp`; empty: nowhere
  Instant offered_until_{};  // there
  Instant polls_until_{};    // after the last loan
  Instant heard_{};          // a byte of the port, or the client has left
};

}  // namespace baudgate::lines
