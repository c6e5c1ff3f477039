// What a Modbus device is asked and what its answers mean, in every framing. Points come from the
// configuration, readings go to gateway/bus/poller/poller.h. Identification checks that a device is
// what its profile says.
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

// Whether a device is what its profile says, by what it says of itself: vendor and product (43/14),
// else its server id (17). Asked once a connection, before the first poll, and only where the
// profile lists names: many slaves are silent to both, and silence costs a reply time. Refused or
// silent is no contradiction. Asked by ModbusConversation.
//
//   > 2B 0E 01 00    < 2B 0E 01 01 00 00 03  00 08 "KBR GmbH"  01 10 "multicomp F144-3"  02 …
//
class Identification {
 public:
  /// `identity` outlives it.
  explicit Identification(const config::Identity& identity) : identity_(identity) {}

  /// The PDU to ask before a poll; empty: none is left.
  std::optional<Bytes> Next();
  /// Whether a request is one of these.
  bool IsAskedBy(const Bytes& pdu) const { return !done_ && !asked_.empty() && pdu == asked_; }
  /// It was answered with this; empty: with an exception, or not at all.
  void OnAnswer(const std::optional<Data>& data);
  /// A poll was answered. A device that is another one is asked again.
  void OnPolled() { again_ = trouble_.reason != Reason::none; }
  /// Another device may answer now. What is wrong stays wrong until it is known to be right.
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

/// Shared by all devices behind one TCP connection: no two of their requests have the same number.
class Transactions : public Bus {
 public:
  std::uint16_t Next() { return ++last_; }

 private:
  std::uint16_t last_ = 0;
};

class ModbusConversation : public Conversation {
 public:
  /// Both outlive the conversation; `transactions`: of tcp.
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
  /// One exchange, its checks done.
  struct Exchanged {
    Answer answer;
    Bytes request;  ///< PDUs
    Bytes reply;
    std::uint8_t exception = 0;
    std::optional<Data> data{};  ///< of a good reply to a read
  };

  /// Without what the reply means for the points.
  Exchanged Judge(View request, View frame) const;
  Exchanged Decode(View request, View frame) const;
  /// Where a point that is read begins.
  std::pair<Space, std::size_t> BeginIn(std::uint32_t point) const;
  /// Points that begin in the block, in their order; of a table without addresses all of its space.
  std::vector<std::size_t> PointsIn(const Block<Space>& block) const;
  void AddReadings(Exchanged& exchanged) const;
  void AddLabels(Exchanged& exchanged) const;
  void AddFaults(Exchanged& exchanged) const;
  Request MakeRequest(View pdu) const;
  /// A loopback, or reads that no poll makes: the next one where the device refuses one.
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
  std::vector<std::optional<Location>> places_;  // by point
  std::vector<std::uint32_t> by_place_;          // points that are read, by space and begin
  SpacePlan plan_;
  Writing writing_;
  Identification identification_;
  // An identification may come in several replies: what to ask for next.
  std::optional<std::pair<Space, std::uint8_t>> next_object_;
  ProbeChoice probes_;
  std::size_t own_probe_ = 0;  // which one of its own goes out next
};

}  // namespace baudgate::protocols::modbus
