// What another device of the same kind would say on the same line: the same profile and options at
// another address, with its own conversation and twin. For the fault wrong_address of
// gateway/simulate/twin_faults.h, without knowing any protocol.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/model/device.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "protocols/protocol.h"

namespace baudgate {

class TwinStranger {
 public:
  /// At the first address of this protocol that `device` does not answer to, measuring `values`;
  /// nothing when there is none.
  static std::optional<TwinStranger> Create(const Protocol& protocol, const config::Device& device,
                                            TwinValues& values, Instant now);

  const std::string& address() const { return address_; }
  /// Its reply to the one of its own requests that is most like `request`.
  Bytes ReplyTo(View request) const;

 private:
  struct Spoken {
    Bytes request;
    Bytes reply;
  };
  explicit TwinStranger(std::string address) : address_(std::move(address)) {}

  void Converse(const Protocol& protocol, const config::Device& device, TwinValues& values,
                Instant now);
  /// Whether the conversation has planned its queries anew.
  bool Perform(const Task& task, const Protocol& protocol, Conversation& conversation, Twin& twin,
               Instant now);

  std::string address_;
  std::vector<Spoken> spoken_;
};

}  // namespace baudgate
