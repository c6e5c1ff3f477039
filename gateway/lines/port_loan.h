// `PortLoan` lends the port of a line to a network client: it decides when the client gets the
// port, for how long, and when the line may continue. LineParts (gateway/lines/line_runner.h)
// contains it; clients connect at gateway/lines/serial_server/server.h.
//
//   free → wanted (the current exchange ends) → held (the client has the port)
//        → rests (until the bus is silent) → free
//
// A client that asks for the port during `rests`, or up to 5 s later, waits, so that the line polls
// between two loans.
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
#include "gateway/records/audit/security_journal.h"
#include "transports/transport.h"

namespace baudgate::lines {

struct LoanRecords {
  audit::WriteLog* log = nullptr;             ///< null: loans are not recorded
  bool required = false;                      ///< true: a loan that cannot be recorded is refused
  audit::SecurityJournal* journal = nullptr;  ///< null: arrivals of clients are not recorded
};

class PortLoan final : public serial_server::PortOwner {
 public:
  class Line {
   public:
    /// Returns why the port cannot be lent now; nothing if it can be lent.
    virtual std::optional<std::string> WhyNot() const = 0;
    /// Stops new exchanges. Returns true if no exchange runs.
    virtual bool Quiet() = 0;
    /// The client `text` has the port until `until`. The points of the line are out of service.
    virtual void OnLent(const std::string& text, WallTime until, Now now) = 0;
    /// The line has its port again, with its settings, and continues.
    virtual void OnReturned(Now now) = 0;
    /// The settings of the port could not be restored.
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
    /// Time that the bus must be silent after a loan, because late replies to the client may come.
    Duration rest{};
  };
  /// The references must outlive this object.
  PortLoan(const Links& links, Line& line)
      : links_(links), number_(links.store.LineIndex(links.config)), line_(line) {}

  // Servers call these functions; see PortOwner.
  void Want(serial_server::PortUser& user, const serial_server::Visit& visit, Now now) override;
  void Return(serial_server::PortUser& user, const serial_server::Visit& visit,
              const std::string& why, Now now) override;
  void OnListening(const std::string& place, const std::string& trouble, Now now) override;
  void OnArrival(const Arrival& arrival, Now now) override;
  void Serve(const config::PortServer& server) { ShowService(server, std::nullopt); }
  /// Shows the server of `release --tcp` in the status, for `time`. The next client gets the port
  /// without a wait for polls (State::waits).
  void Offer(const config::PortServer& server, Duration time, Now now);
  void Withdraw(const config::PortServer& server);

  /// Passes bytes to the client that has the port. Returns false if the bytes are for the line.
  bool PassToClient(View bytes, Now now);
  void OnRoom();
  /// Disconnects the client, because the port is closed or lent to another program.
  void OnClosed(const std::string& reason, Now now);
  void TakeBackFrom(serial_server::PortUser& user, const std::string& why, Now now) {
    if (user_ == &user) TakeBack(why, now);
  }
  /// Disconnects the client that has the port or waits for it. The line polls again afterwards.
  void TakeBack(const std::string& why, Now now);
  /// True if a client has the port, or the line still waits for silence after a loan.
  bool has_port() const { return state_ == State::held || state_ == State::rests; }
  /// Returns "the port is in use by 10.0.0.7:40112"; nothing if no client has the port or asks for
  /// it.
  std::optional<std::string> InUse() const;
  /// Hands the port to a waiting client if no exchange runs. To be called after every input of the
  /// line. Returns true if a client waits, so that the line must start no exchange.
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
  // Number of the line in the store, which no longer finds a line that a reload has ended.
  const std::uint32_t number_;
  Line& line_;
  State state_ = State::free;
  serial_server::PortUser* user_ = nullptr;  // the server that asks for the port, or has it
  serial_server::Visit visit_;
  Instant wanted_at_{};
  Instant until_{};
  Instant show_at_{};       // when the status is updated next
  std::string offered_at_;  // address of the server of `release --tcp`; empty: no server
  Instant offered_until_{};
  Instant polls_until_{};  // until then the line polls between two loans
  Instant heard_{};        // time of the last byte from the port, or when the client left
};

}  // namespace baudgate::lines
