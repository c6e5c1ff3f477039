// What a DCON reply means for the request that it answers: one pure function under the
// conversation, `decode` and the tests. Frames come from the line, results go to conversation.h.
// ReadPrinted reads replies as the makers' manuals print them.
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
  std::string remedy{};  ///< for `baudgate status`
  Form form = Form::text;
  /// Joined numbers give one a channel, any other reply one; a confirmed write none.
  std::vector<Field> fields;
  bool ignored = false;  ///< a write: the host watchdog has tripped
  /// It refuses a write, and the output may have moved anyway.
  bool may_have_acted = false;
  bool first_fetch = false;   ///< of a sample: it has not been fetched before
  bool more_enabled = false;  ///< values came for channels that the settings call disabled
};

/// `form`: how the points read this command; nothing = guessed from the reply's own shape.
/// `channels`: how many values a joined reply must have, 0 = any.
DecodedReply DecodeReply(const Command& request, std::optional<Form> form, std::size_t channels,
                         View frame, const Settings& settings);

/// The same of a command that is a setting (WriteAddress): `!AA`, whatever its reply is on modules
/// where it is a read.
DecodedReply DecodeConfirmation(const Command& request, View frame, const Settings& settings);

/// The value that `address` selects. A field that the reply does not have is bad.
Field Select(const DecodedReply& decoded, const ReadAddress& address);

/// The checksum variant of the reply to `command`.
int ReplyVariant(std::string_view command, const Settings& settings);

/// The address that a reply carries: the request's own, or the new one after `%AANN...`.
std::uint8_t ReplyAddress(const Command& request);

// Replies as the makers' manuals print them, for `baudgate decode`: what an exchange says when no
// point of the device reads its command. Polling never asks this file, because there a reply has
// the one form that its point names. Requests and replies come from codec.h.

/// The values with their labels; nothing when no manual prints such a reply to `request`. Where
/// makers disagree, every printed form is taken and the label says which one it is.
std::optional<Answer> ReadPrinted(const Command& request, View frame, const Settings& settings);

}  // namespace baudgate::protocols::dcon
