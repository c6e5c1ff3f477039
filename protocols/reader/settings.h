// The options of a reader, as a table for users and as a struct for the code.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "config/model/options.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::reader {

enum class Form : std::uint8_t { tag, text };

struct Settings {
  Form form = Form::tag;
  /// The character that begins a text; empty: any character begins it.
  std::optional<std::uint8_t> start{};
  /// The character that ends a text; empty: `length` or a silence ends the text.
  std::optional<std::uint8_t> end{};
  std::size_t length = 0;  ///< number of characters between start and end; 0: any number
  std::size_t most = 80;   ///< the maximum number of characters between start and end
  Duration idle{};         ///< the silence that ends a message
  Duration whole{};        ///< the maximum duration of a message
  /// A text that comes again within this time since it came last is not a new tag.
  Duration same_tag{};
  /// How long a tag counts as present after its message; zero: until "no tag" comes.
  Duration present{};
  bool asks = false;  ///< true: the gateway sends the commands of codec.h
  Duration answer{};  ///< the maximum time until the reply to a command
};

std::span<const OptionSpec> OptionTable();
Settings ReadSettings(const config::Options& options);
Status CheckOptions(const config::Options& options);

}  // namespace baudgate::protocols::reader
