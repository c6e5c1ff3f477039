// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/settings.h"

#include "protocols/option_specs.h"

namespace baudgate::protocols::dcon {
namespace {

constexpr OptionSpec kOptions[] = {
    option::Flag("checksum", "false",
                 "The module's checksum is on (bit 6 of its format byte); both ends must agree."),
    option::Integer("width", "7", 0, 32,
                    "Characters of every number, sign and point included; 0 takes any width."),
    option::Integer(
        "channels", "0", 0, 32,
        "How many values # answers; another count is not believed. 0: as the points ask."),
    option::Integer(
        "enable_mask", "4294967295", 1, 4294967295.0,
        "Channels enabled in the module, bit 0 = channel 0; the others are out of service."),
    option::Choice("disabled", "missing", "missing,blank,zero",
                   "How # shows a disabled channel: its field is missing, blank or zero."),
    option::Choice("format", "engineering", "engineering,percent,hex",
                   "Data format set in the module (bits 1:0 of its format byte)."),
    option::Real("full_scale", "0", 0, 0, "Value of 7FFF in hex numbers; 0 gives the bare number."),
    option::Flag("hex_unsigned", "false",
                 "Hex numbers run from 0000 to FFFF (unipolar ranges) instead of 8000 to 7FFF."),
    option::Texts("over", "+9999.9",
                  "Fields that mean above range, besides nines without a point."),
    option::Texts(
        "under", "-9999.9",
        "Fields that mean below range, besides nines or zeros with a minus and no point."),
    option::Texts("open", "+888888", "Fields that mean an open sensor circuit."),
    option::Integer("invert", "0", 0, 65535,
                    "Bits of a 16-bit digital reply that read the wrong way round, as a mask."),
    option::Flag("data_address", "false",
                 "Replies with '>' carry the module's address (Trycom TRP-C68)."),
    option::Flag("write_ack_address", "false", "A write may be confirmed by !AA as well as by >."),
    option::Choice(
        "counter_checksum", "either", "either,end,front",
        "Place of the checksum in counter replies; I-7080 and CB-7080 send it in front."),
    option::Flag("identify", "false",
                 "The module knows $AAM: a silent device is looked for with it."),
};

}  // namespace

std::span<const OptionSpec> OptionTable() { return kOptions; }

Settings ReadSettings(const config::Options& options) {
  Settings settings;
  settings.checksum = options.Flag("checksum");
  settings.width = static_cast<std::size_t>(options.Integer("width"));
  settings.channels = static_cast<std::size_t>(options.Integer("channels"));
  settings.enabled = static_cast<std::uint32_t>(options.Integer("enable_mask"));
  const std::string& disabled = options.Text("disabled");
  settings.disabled = disabled == "blank"  ? Disabled::blank
                      : disabled == "zero" ? Disabled::zero
                                           : Disabled::missing;
  const std::string& format = options.Text("format");
  settings.format = format == "percent" ? Format::percent
                    : format == "hex"   ? Format::hex
                                        : Format::engineering;
  settings.full_scale = options.Real("full_scale");
  settings.hex_unsigned = options.Flag("hex_unsigned");
  settings.over = options.Texts("over");
  settings.under = options.Texts("under");
  settings.open = options.Texts("open");
  settings.invert = static_cast<std::uint16_t>(options.Integer("invert"));
  settings.data_address = options.Flag("data_address");
  settings.write_ack_address = options.Flag("write_ack_address");
  const std::string& place = options.Text("counter_checksum");
  settings.counter_checksum = place == "end"     ? ChecksumPlace::end
                              : place == "front" ? ChecksumPlace::front
                                                 : ChecksumPlace::either;
  settings.identify = options.Flag("identify");
  return settings;
}

}  // namespace baudgate::protocols::dcon
