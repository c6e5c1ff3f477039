// Whether a device is what its profile says, by what it says of itself: vendor and product (43/14),
// else its server id (17). Asked once a connection, before the first poll, and only where the
// profile lists names: many slaves are silent to both, and silence costs a reply time. Refused or
// silent is no contradiction. Asked by conversation.h.
//
//   > 2B 0E 01 00    < 2B 0E 01 01 00 00 03  00 08 "KBR GmbH"  01 10 "multicomp F144-3"  02 …
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/model/device.h"
#include "protocols/conversation.h"
#include "protocols/modbus/space.h"

namespace baudgate::protocols::modbus {

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

}  // namespace baudgate::protocols::modbus
