// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/settings.h"

#include "protocols/common/settings.h"
#include "protocols/spabus/reply.h"

namespace baudgate::protocols::spabus {
namespace {

constexpr auto kTable = SettingsTable(
    Bind<&Settings::max_items>(option::Integer(
        "max_items", "8", 1, 64,
        "Largest number of items that one request reads; 1 for devices that refuse ranges.")),
    Bind<&Settings::write_items>(option::Integer(
        "write_items", "1", 1, 64,
        "Largest number of adjacent items that one request writes, as in W S21/23; 1: one item. If "
        "the device refuses several items, it is not known which of them it took.")),
    Bind<&Settings::password>(
        option::Secret(option::Integer("password", "0", 0, 999,
                                       "Password that is opened (V160) before and closed (V161) "
                                       "after each write; 0: the device needs none."))),
    Bind<&Settings::send_wildcard>(option::Flag(
        "send_xx", "false", "Send XX instead of the checksum; the device then checks nothing.")),
    Bind<&Settings::accept_wildcard>(option::Flag("accept_xx", "true",
                                                  "Accept replies with XX instead of a checksum; "
                                                  "false is safer if the device never sends XX.")),
    Bind<&Settings::line_feed_in_checksum>(option::Flag(
        "lf_in_checksum", "false",
        "The device includes the line feed before '<' in the checksum of its replies.")),
    Bind<&Settings::continuation>(option::Choice(
        "continuation_checksum", "auto", "auto,a,b,c,d",
        "What the checksum of a reply in several lines covers. a: everything; b: all but CR and "
        "LF; c: all but CR, LF and &; d: the last line only; auto: learned from the replies.")),
    Bind<&Settings::send_seconds>(option::OnLine(option::Time(
        "send_seconds", "0s",
        "Interval at which the second of the minute (T) is sent to all relays; 0s: never."))),
    Bind<&Settings::send_date>(option::OnLine(option::Time(
        "send_date", "0s",
        "Interval at which date and time (D) are sent to all relays that support it; 0s: never."))),
    Bind<&Settings::date_zone>(
        option::OnLine(option::Choice("date_zone", "local", "local,standard,utc",
                                      "Time of D: local time of this machine, local time without "
                                      "summer time (standard), or UTC."))),
    Bind<&Settings::clock_delay>(option::OnLine(option::Time(
        "clock_delay", "0s",
        "Delay of T and D in converters, in addition to the time of their characters."))));

int Covered(Continuation continuation) {
  switch (continuation) {
    case Continuation::all:
      return kCoversAll;
    case Continuation::no_line_ends:
      return kCoversNoLineEnds;
    case Continuation::characters:
      return kCoversCharacters;
    case Continuation::last_line:
      return kCoversLastLine;
    case Continuation::learned:
      break;
  }
  return kCoversAny;
}

}  // namespace

std::span<const OptionSpec> OptionTable() { return kTable.specs(); }

Settings ReadSettings(const config::Options& options) { return kTable.Read(options); }

ClockSettings ClockSettingsOf(const Settings& settings) {
  return {settings.send_seconds, settings.send_date, settings.date_zone, settings.clock_delay};
}

int ChecksumBits(const Settings& settings) {
  int bits = Covered(settings.continuation);
  if (settings.line_feed_in_checksum) bits |= kLineFeedCovered;
  if (settings.accept_wildcard) bits |= kWildcardAccepted;
  return bits;
}

}  // namespace baudgate::protocols::spabus
