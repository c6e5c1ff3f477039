// ModbusConversation plans the requests of one Modbus device and turns its replies into readings,
// in any framing. Identification checks that the device fits its profile.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/model/device.h"
#include "protocols/common/identification.h"
#include "protocols/conversation.h"
#include "protocols/modbus/codec.h"
#include "protocols/modbus/plan.h"
#include "protocols/modbus/settings.h"
#include "protocols/modbus/writing.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::modbus {

// Identification checks by vendor and product (function 43/14), else by server id (17), whether a
// device fits its profile. ModbusConversation asks once per connection, before the first poll, and
// only if the profile lists names: many slaves answer neither request, and each silence costs a
// reply time. A refusal or silence is not a contradiction.
//
//   > 2B 0E 01 00    < 2B 0E 01 01 00 00 03  00 08 "KBR GmbH"  01 10 "multicomp F144-3"  02 …
class Identification {
 public:
  explicit Identification(const config::Identity& identity) : identity_(identity) {}

  /// Returns the PDU of the identification request to send before a poll. Empty: there is none to
  /// send.
  std::optional<Bytes> Next();
  bool IsAskedBy(const Bytes& pdu) const { return !done_ && !asked_.empty() && pdu == asked_; }
  /// Call it with the decoded reply to the request of Next; empty if the reply was an exception or
  /// did not come.
  void OnAnswer(const std::optional<Data>& data);
  /// Call it after an answered poll. If the device contradicts its profile, the identification
  /// requests are repeated before the next poll.
  void OnPolled() { again_ = trouble_.reason != Reason::none; }
  /// Call it if another device may be connected. A trouble stays until a reply disproves it.
  void OnReconnect();

  const DeviceTrouble& trouble() const { return trouble_; }

 private:
  enum class Step { objects, server, over };

  void Judge(const std::vector<std::string>& names);

  const config::Identity& identity_;
  Step step_ = Step::objects;
  bool done_ = false;
  bool again_ = false;
  Bytes asked_;
  DeviceTrouble trouble_;
};

/// The transaction counter that the devices behind one TCP connection share, so that all their
/// requests have different numbers.
class Transactions : public Bus {
 public:
  std::uint16_t Next() { return ++last_; }

 private:
  std::uint16_t last_ = 0;
};

class ModbusConversation : public Conversation {
 public:
  /// The references must outlive the conversation. `transactions` is used for tcp only.
  ModbusConversation(Framing framing, const config::Device& device, const Settings& settings,
                     Transactions* transactions = nullptr);

  std::span<const Query> Queries() const override { return plan_.queries(); }
  Result<Request> Ask(const Task& task, Instant now) override;
  std::size_t WritesTogether(std::span<const PointValue> writes) const override {
    return writing_.Together(writes);
  }
  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override;
  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant now) override;
  void OnReconnect() override;
  const DeviceTrouble& trouble() const override { return identification_.trouble(); }
  Outcome Check(View request, View frame) const override;
  Answer Interpret(View request, View frame) override;

 private:
  /// A request and its reply after all checks.
  struct Exchanged {
    Answer answer;
    Bytes request;  ///< `request` and `reply` are PDUs, without address and check value
    Bytes reply;
    std::uint8_t exception = 0;
    std::optional<Data> data{};  ///< the decoded reply; empty unless it is a good reply to a read
  };

  /// Checks the reply against the request, without decoding the values.
  Exchanged Judge(View request, View frame) const;
  Exchanged Decode(View request, View frame) const;
  std::pair<Space, std::size_t> BeginIn(std::uint32_t point) const;
  /// Returns the points that begin in the block. If the block's table has no addresses
  /// (IsAddressed), returns all points of the table.
  std::vector<std::size_t> PointsIn(const Block<Space>& block) const;
  void AddReadings(Exchanged& exchanged) const;
  void AddLabels(Exchanged& exchanged) const;
  void AddFaults(Exchanged& exchanged) const;
  Request MakeRequest(View pdu) const;
  /// Returns the probes that no poll sends: up to three reads, or a loopback. If the device refuses
  /// one of them, the next one is used.
  std::vector<Bytes> OwnProbes() const;
  Bytes PollPdu(std::size_t query) const;
  Reading ReadingOf(std::size_t point, const Data& data) const;
  Answer AfterWrite(Exchanged exchanged);
  std::optional<std::size_t> OwnProbeOf(View pdu) const;
  Answer AfterProbe(Exchanged exchanged);
  Answer AfterIdentification(Exchanged exchanged);
  Answer AfterPoll(std::size_t query, Exchanged exchanged, Instant now);

  const Framing framing_;
  const config::Device& device_;
  Transactions* const transactions_;
  Settings settings_;
  std::uint8_t slave_;
  std::vector<std::optional<Location>> places_;  // index: point; empty: the point is not read
  std::vector<std::uint32_t> by_place_;  // the points that are read, sorted by space and begin
  SpacePlan plan_;
  Writing writing_;
  Identification identification_;
  // The object with which the identification goes on, if the last reply has not contained all
  // objects. Empty: the next request begins with the first object.
  std::optional<std::pair<Space, std::uint8_t>> next_object_;
  ProbeChoice probes_;
  std::size_t own_probe_ = 0;
};

}  // namespace baudgate::protocols::modbus
