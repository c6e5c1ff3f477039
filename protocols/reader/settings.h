// The options of a reader: their table for users, and the same as a struct for the code. They come
// from the configuration and go to the frame rule, the conversation and the twin.
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
  std::optional<std::uint8_t> start{};  ///< of text: nothing: it begins with any character
  std::optional<std::uint8_t> end{};    ///< empty: `length` or silence ends it
  std::size_t length = 0;               ///< characters between the two; 0: any number
  std::size_t most = 80;                ///< the same, at most
  Duration idle{};                      ///< silence that ends a message
  Duration whole{};                     ///< no message takes longer
  Duration same_tag{};                  ///< the same again within so long is no new one
  Duration present{};                   ///< it is there for so long; zero: until the reader says no
  bool asks = false;                    ///< it is sent commands, see codec.h
  Duration answer{};                    ///< so long it may take to answer them
};

std::span<const OptionSpec> OptionTable();
Settings ReadSettings(const config::Options& options);
/// Whether the options fit together.
Status CheckOptions(const config::Options& options);

}  // namespace baudgate::protocols::reader
