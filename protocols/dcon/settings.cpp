// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/settings.h"

#include "protocols/common/settings.h"

namespace baudgate::protocols::dcon {
namespace {

constexpr auto kTable = SettingsTable(
    Bind<&Settings::checksum>(option::Flag(
        "checksum", "false",
        "The module's checksum is on (bit 6 of its format byte); both ends must agree.")),
    Bind<&Settings::width>(
        option::Integer("width", "7", 0, 32,
                        "Width of every number in characters, with sign and point; 0: any width.")),
    Bind<&Settings::channels>(
        option::Integer("channels", "0", 0, 32,
                        "Number of values in a reply to #; a reply with another number is "
                        "rejected. 0: as the points need.")),
    Bind<&Settings::enabled>(option::Integer("enable_mask", "4294967295", 1, 4294967295.0,
                                             "Channels that are enabled in the module, bit 0 = "
                                             "channel 0; other channels are out of service.")),
    Bind<&Settings::disabled>(option::Choice(
        "disabled", "missing", "missing,blank,zero",
        "How a reply to # shows a disabled channel: its field is missing, blank or zero.")),
    Bind<&Settings::format>(
        option::Choice("format", "engineering", "engineering,percent,hex",
                       "Data format set in the module (bits 1:0 of its format byte).")),
    Bind<&Settings::full_scale>(option::Real(
        "full_scale", "0", 0, 0, "Value of 7FFF in hex numbers; 0: hex numbers are not scaled.")),
    Bind<&Settings::hex_unsigned>(option::Flag(
        "hex_unsigned", "false",
        "Hex numbers run from 0000 to FFFF (unipolar ranges) instead of 8000 to 7FFF.")),
    Bind<&Settings::over>(option::Texts(
        "over", "+9999.9", "Fields that mean over range, besides nines without a point.")),
    Bind<&Settings::under>(option::Texts(
        "under", "-9999.9",
        "Fields that mean under range, besides nines or zeros with a minus and no point.")),
    Bind<&Settings::open>(option::Texts("open", "+888888", "Fields that mean an open sensor.")),
    Bind<&Settings::nines>(option::Flag(
        "nines", "false",
        "Five nines mean over range, with '-' under range, with the point anywhere (OWEN).")),
    Bind<&Settings::swap_bytes>(option::Flag(
        "swap_bytes", "false", "The two bytes of a 16-bit digital reply are swapped.")),
    Bind<&Settings::invert>(option::Integer(
        "invert", "0", 0, 65535, "Bits of a 16-bit digital reply that are inverted, as a mask.")),
    Bind<&Settings::data_address>(option::Flag(
        "data_address", "false", "Replies with '>' carry the module's address (Trycom TRP-C68).")),
    Bind<&Settings::write_ack_address>(
        option::Flag("write_ack_address", "false", "A write is confirmed by !AA as well as by >.")),
    Bind<&Settings::counter_checksum>(option::Choice(
        "counter_checksum", "either", "either,end,front",
        "Position of the checksum in counter replies; I-7080 and CB-7080 send it in front.")),
    Bind<&Settings::counter_maximum>(
        option::Integer("counter_maximum", "4294967295", 1, 4294967295.0,
                        "Count after which a counter starts again at 0; used for totals.")),
    Bind<&Settings::count_rate>(
        option::Real("count_rate", "100000", 0, 0,
                     "Highest number of pulses per second; a larger step is not counted as a "
                     "roll-over in totals. 0: no limit.")),
    Bind<&Settings::identify>(option::Flag(
        "identify", "true",
        "Read $AAM and $AA2 before anything else. false: for modules that know only # (OWEN).")),
    Bind<&Settings::types>(option::Texts(
        "types", "",
        "Type codes that the module may have, in hex; with another code, no value is good.")),
    Bind<&Settings::host_watchdog>(option::OnLine(option::Time(
        "host_watchdog", "0s",
        "How often ~** is sent to all modules to show that the host is alive; 0s: never."))),
    Bind<&Settings::channel_types>(option::Flag(
        "channel_types", "false", "Each input of the module has a type code of its own.")));

}  // namespace

std::span<const OptionSpec> OptionTable() { return kTable.specs(); }

Settings ReadSettings(const config::Options& options) { return kTable.Read(options); }

}  // namespace baudgate::protocols::dcon
