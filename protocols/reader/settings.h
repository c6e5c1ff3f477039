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
  std::optional<std::uint8_t> start{};  ///< the first character of a text; empty: any
  /// The last character of a text; empty: `length` or silence ends it.
  std::optional<std::uint8_t> end{};
  std::size_t length = 0;  ///< characters between start and end; 0: any number
  std::size_t most = 80;   ///< the maximum number of characters between start and end
  Duration idle{};         ///< the silence that ends a message
  Duration whole{};        ///< the maximum duration of a message
  Duration same_tag{};     ///< a text that comes again within this time is not new
  Duration present{};      ///< how long a tag counts as present; zero: until "no tag"
  bool asks = false;       ///< commands may be sent, see codec.h
  Duration answer{};       ///< the maximum time until the reply to a command
};

std::span<const OptionSpec> OptionTable();
Settings ReadSettings(const config::Options& options);
Status CheckOptions(const config::Options& options);

}  // namespace baudgate::protocols::reader
