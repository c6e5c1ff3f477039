// SPDX-License-Identifier: Apache-2.0
#include "protocols/reader/settings.h"

#include <string>

#include "gateway/base/text.h"
#include "protocols/common/settings.h"

namespace baudgate::protocols::reader {
namespace {

/// Parses a character: "" (none), ":" (the character itself) or "0x0D" (its number).
Result<std::optional<std::uint8_t>> ParseCharacter(const std::string& text) {
  if (text.empty()) return std::optional<std::uint8_t>();
  if (text.size() == 1) return std::optional(static_cast<std::uint8_t>(text[0]));
  const auto code =
      text.starts_with("0x") ? ParseInteger<std::uint8_t>(text.substr(2), 16) : std::nullopt;
  if (!code)
    return Error{"'" + text +
                 "' is not a character; write one character, as ':', or its code, as 0x02"};
  return std::optional(*code);
}

constexpr auto kTable = SettingsTable(
    Bind<&Settings::form>(option::Choice(
        "form", "tag", "tag,text",
        "tag: frames of an RFID reader; text: any text, framed by the options below.")),
    Bind<&Settings::start, ParseCharacter>(
        option::Text("start", "", "First character of a text, as ':' or '0x02'; empty: any.")),
    Bind<&Settings::end, ParseCharacter>(
        option::Text("end", "0x0D", "Last character of a text; empty: length or silence ends it.")),
    Bind<&Settings::length>(option::Integer(
        "length", "0", 0, 120, "Exact number of characters between start and end; 0: any.")),
    Bind<&Settings::most>(option::Integer(
        "most", "80", 1, 120, "Longest text in characters; a longer text counts as damaged.")),
    Bind<&Settings::idle>(option::Time("idle", "100ms", "Silence that ends a message.")),
    Bind<&Settings::whole>(option::Time(
        "whole", "2s", "Longest duration of a message; a longer message counts as damaged.")),
    Bind<&Settings::same_tag>(option::Time(
        "same_tag", "2s",
        "The same tag within this time is not a new tag; 0s: every message is a new tag.")),
    Bind<&Settings::present>(option::Time(
        "present", "2s",
        "A tag counts as present for this time; 0s: until the reader sends 'no tag'.")),
    Bind<&Settings::asks>(
        option::Choice("commands", "none", "none,ask",
                       "none: the gateway sends nothing. ask: the gateway sends r "
                       "(for a tag) and i (for the reader's name); only with "
                       "form: tag.")),
    Bind<&Settings::answer>(option::Time("answer", "1s", "Reply timeout of a command.")));

}  // namespace

std::span<const OptionSpec> OptionTable() { return kTable.specs(); }

Settings ReadSettings(const config::Options& options) { return kTable.Read(options); }

Status CheckOptions(const config::Options& options) {
  if (Status status = kTable.Check(options); !status) return status;
  const Settings settings = ReadSettings(options);
  if (settings.length > settings.most)
    return Error{"length must not be larger than most; raise most, or lower length"};
  if (settings.start && settings.start == settings.end) {
    return Error{
        "start and end are the same character, so they cannot be told apart; set different "
        "characters"};
  }
  if (settings.idle < 1ms) return Error{"idle must be at least 1ms"};
  if (settings.whole < settings.idle)
    return Error{"whole must not be shorter than idle; raise whole, or lower idle"};
  if (!settings.asks) return {};
  if (settings.form != Form::tag)
    return Error{"commands: ask needs form: tag; write form: tag, or remove commands"};
  if (settings.answer < 1ms) return Error{"answer must be at least 1ms"};
  if (settings.same_tag < 2 * settings.answer) {
    return Error{
        "with commands: ask, same_tag must be at least twice answer, because a late answer would "
        "count as another tag; raise same_tag"};
  }
  return {};
}

}  // namespace baudgate::protocols::reader
