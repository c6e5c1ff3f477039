// Decodes the reply to a DCON request. The functions do no I/O; the conversation, `baudgate decode`
// and the tests use them. ReadPrinted accepts replies in the forms that the makers' manuals print.
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
  std::string remedy{};  ///< advice to the user in `baudgate status`
  Form form = Form::text;
  /// One field for each channel of joined numbers, one field for any other reply, and no field for
  /// a confirmed write.
  std::vector<Field> fields;
  /// True: the module has ignored the write, because its host watchdog has tripped.
  bool ignored = false;
  /// True: the module has refused the write, but the output may have moved.
  bool may_have_acted = false;
  /// For a reply with a sample: true if this sample was fetched for the first time.
  bool first_fetch = false;
  /// True: the reply contains channels that are disabled in the settings.
  bool more_enabled = false;
};

/// Decodes the reply `frame`. `form`: the form that the points expect; empty: the form is guessed
/// from the characters of the reply. `channels`: how many values a reply of joined numbers must
/// have; 0: any number.
DecodedReply DecodeReply(const Command& request, std::optional<Form> form, std::size_t channels,
                         View frame, const Settings& settings);

/// Decodes the reply to a command that writes a setting (WriteAddress::setting). The reply must be
/// `!AA`, even if the same command is a read on other modules.
DecodedReply DecodeConfirmation(const Command& request, View frame, const Settings& settings);

/// Returns the field that `address` selects. If the reply does not have this field, the result has
/// a bad quality and no value.
Field Select(const DecodedReply& decoded, const ReadAddress& address);

int ReplyVariant(std::string_view command, const Settings& settings);

/// Returns the address that the reply must have: the address of the request, or the new address
/// after `%AANN...`.
std::uint8_t ReplyAddress(const Command& request);

// ReadPrinted serves `baudgate decode`, for commands that no point of the device reads. Polls do
// not use it, because the point defines the one form that its reply must have.

/// Decodes a reply in one of the forms that the makers' manuals print. Returns its values with
/// labels, or nothing if no manual prints this form of reply to `request`. If makers use one
/// command in different ways, the label says which meaning was found.
std::optional<Answer> ReadPrinted(const Command& request, View frame, const Settings& settings);

}  // namespace baudgate::protocols::dcon
