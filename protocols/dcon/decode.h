// Decodes the reply to a DCON request. The functions are pure; the conversation, `baudgate decode`
// and the tests use them. ReadPrinted accepts replies in the forms that the makers' manuals print.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "protocols/conversation.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/points.h"
#include "protocols/dcon/values.h"

namespace baudgate::protocols::dcon {

struct DecodedReply {
  Outcome outcome = Outcome::ok;
  std::string reason;
  std::string remedy{};  ///< advice for `baudgate status`
  Form form = Form::text;
  /// Joined numbers give one field per channel, any other reply one field, a confirmed write none.
  std::vector<Field> fields;
  bool ignored = false;  ///< a write was ignored because the host watchdog has tripped
  /// A write was refused, but the output may have moved.
  bool may_have_acted = false;
  bool first_fetch = false;   ///< of a sample: it was not fetched before
  bool more_enabled = false;  ///< the reply contains channels that the settings call disabled
};

/// `form`: the form that the points expect; empty: guessed from the reply's shape. `channels`: how
/// many values a joined reply must have; 0: any.
DecodedReply DecodeReply(const Command& request, std::optional<Form> form, std::size_t channels,
                         View frame, const Settings& settings);

/// Decodes the reply to a command that writes a setting (WriteAddress::setting). It must be `!AA`,
/// even if the same command is a read on other modules.
DecodedReply DecodeConfirmation(const Command& request, View frame, const Settings& settings);

/// Returns the field that `address` selects. If the reply does not have it, its quality is bad.
Field Select(const DecodedReply& decoded, const ReadAddress& address);

/// Returns the ChecksumVariant of the reply to `command`.
int ReplyVariant(std::string_view command, const Settings& settings);

/// Returns the address in the reply: that of the request, or the new one after `%AANN...`.
std::uint8_t ReplyAddress(const Command& request);

// `baudgate decode` uses ReadPrinted for exchanges whose command no point of the device reads.
// Polling does not use it, because there each reply has the one form that its point defines.

/// Returns the values with labels, or nothing if no manual prints this form of reply to `request`.
/// If the makers disagree, all printed forms are accepted and the label names the form.
std::optional<Answer> ReadPrinted(const Command& request, View frame, const Settings& settings);

}  // namespace baudgate::protocols::dcon
