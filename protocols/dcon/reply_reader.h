// What replies of one module mean for its points. It remembers nothing.
//
//   > #01   < >+05.880+01.230     point "#[0]" is 5.88, point "#[1]" is 1.23
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "protocols/conversation.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/decode.h"
#include "protocols/dcon/identification.h"
#include "protocols/dcon/places.h"
#include "protocols/dcon/requests.h"
#include "protocols/dcon/settings.h"

namespace baudgate::protocols::dcon {

/// A request and its reply, decoded.
struct Exchanged {
  Command command;
  DecodedReply reply;
};

class ReplyReader {
 public:
  /// `counts`: totals are kept of counters. All others outlive it.
  ReplyReader(const Settings& settings, const Requests& requests, const Places& places,
              const Identification& identification, bool counts)
      : settings_(settings),
        requests_(requests),
        places_(places),
        identification_(identification),
        counts_(counts) {}

  /// Empty: the request is none.
  std::optional<Exchanged> Read(View request, View frame) const;
  /// A reading of each point that the command reads.
  Answer ReadingsOf(const Exchanged& exchanged) const;
  /// See Conversation::Interpret. `polled`: the device has points.
  Answer Interpret(View request, View frame, bool polled) const;

 private:
  /// The frame ends with a right checksum, but this request went out without one: it is a late
  /// reply to an earlier request in the configured mode.
  bool IsOfOwnMode(View request, View frame) const;
  std::optional<Form> PlannedForm(std::string_view command) const;
  void AddLabels(const Exchanged& exchanged, Answer& answer) const;

  const Settings& settings_;
  const Requests& requests_;
  const Places& places_;
  const Identification& identification_;
  const bool counts_;
};

}  // namespace baudgate::protocols::dcon
