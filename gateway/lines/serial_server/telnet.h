// `TelnetDecoder` cuts the bytes of a client into data, negotiations and subnegotiations of telnet
// as serial servers use it (RFC 854, 855, 856, 857, 858). It does no I/O, its result does not
// depend on fragmentation, and its memory is bounded.
//
//   61 FF FF FF FD 2C FF FA 2C 01 41 FF F0
//   → data 61 · data FF · DO 2C · subnegotiation 2C: 01 41
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bitset>
#include <cstdint>
#include <map>
#include <optional>

#include "gateway/base/bytes.h"

namespace baudgate::serial_server {

namespace telnet {
inline constexpr std::uint8_t kSe = 240;
inline constexpr std::uint8_t kBrk = 243;
inline constexpr std::uint8_t kSb = 250;
inline constexpr std::uint8_t kWill = 251;
inline constexpr std::uint8_t kWont = 252;
inline constexpr std::uint8_t kDo = 253;
inline constexpr std::uint8_t kDont = 254;
inline constexpr std::uint8_t kIac = 255;

inline constexpr std::uint8_t kBinary = 0;
inline constexpr std::uint8_t kEcho = 1;
inline constexpr std::uint8_t kSuppressGoAhead = 3;
inline constexpr std::uint8_t kComPort = 44;  // RFC 2217
}  // namespace telnet

struct TelnetItem {
  enum class What : std::uint8_t { data, negotiation, subnegotiation, break_key };
  What what = What::data;
  std::uint8_t verb = 0;  ///< verb of a negotiation: kWill … kDont
  std::uint8_t option = 0;
  View bytes{};  ///< data, or the content of a subnegotiation; valid until the next call
};

class TelnetDecoder {
 public:
  /// The maximum length of a subnegotiation; a longer subnegotiation is dropped as a whole.
  static constexpr std::size_t kLongest = 300;

  /// Takes the next item from the front of `input`; returns nothing if `input` is used up.
  std::optional<TelnetItem> Next(View& input);
  /// Makes a byte 0 behind a CR count as data. Without this call the byte is dropped.
  void SetBinary() { binary_ = true; }

 private:
  enum class State : std::uint8_t { data, command, negotiation, option, inside, inside_command };

  std::optional<TelnetItem> TakeData(View& input);
  std::optional<TelnetItem> On(std::uint8_t byte);
  std::optional<TelnetItem> OnCommand(std::uint8_t byte);
  std::optional<TelnetItem> OnInside(std::uint8_t byte);

  State state_ = State::data;
  bool binary_ = false;
  bool after_cr_ = false;
  std::uint8_t verb_ = 0;
  std::uint8_t option_ = 0;
  bool too_long_ = false;
  Bytes inside_;
};

/// The telnet options in use (RFC 1143, without its queue). Each unknown option is refused once
/// only, so a flood of unknown options causes at most 512 refusals of three bytes.
class TelnetOptions {
 public:
  /// Returns the offers and requests of the server at the start.
  Bytes Begin();
  /// Returns the answer to a negotiation; empty if no answer is needed.
  Bytes On(std::uint8_t verb, std::uint8_t option);
  bool theirs(std::uint8_t option) const;

 private:
  enum class State : std::uint8_t { no, asked, yes };
  using States = std::map<std::uint8_t, State>;
  static Bytes Answer(States& states, std::bitset<256>& refused, std::uint8_t option, bool on,
                      std::uint8_t yes, std::uint8_t no);

  States ours_{{telnet::kBinary, State::no},
               {telnet::kEcho, State::no},
               {telnet::kSuppressGoAhead, State::no},
               {telnet::kComPort, State::no}};
  States theirs_{{telnet::kBinary, State::no},
                 {telnet::kSuppressGoAhead, State::no},
                 {telnet::kComPort, State::no}};
  std::bitset<256> refused_ours_;
  std::bitset<256> refused_theirs_;
};

/// Appends data for the client, with each FF doubled.
void AppendEscaped(Bytes& out, View data);
/// Returns the bytes IAC SB option … IAC SE, in which each FF of `bytes` is doubled.
Bytes Subnegotiation(std::uint8_t option, View bytes);

// TelnetStream turns the telnet bytes of a client into data and commands for the port, and answers
// the client's negotiations.
class TelnetStream {
 public:
  struct Part {
    enum class Kind : std::uint8_t {
      data,
      command,    ///< a command of RFC 2217
      break_key,  ///< IAC BRK
    };
    Kind kind = Kind::data;
    View bytes{};  ///< valid until the next call
  };

  Bytes Begin() { return options_.Begin(); }
  /// Takes the next part from the front of `input`; returns nothing if `input` is used up. Appends
  /// to `answers` the bytes that must be sent to the client before the part is handled.
  std::optional<Part> Next(View& input, Bytes& answers);

 private:
  TelnetDecoder decoder_;
  TelnetOptions options_;
};

}  // namespace baudgate::serial_server
