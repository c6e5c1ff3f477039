// What people mean by words that the command line does not take.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <ostream>
#include <span>
#include <string>

namespace baudgate {

/// A bit rate whose format stands outside the quotes would be taken for another argument: says so
/// before the words are parsed. Empty: there is none.
std::optional<std::string> UnquotedSerial(std::span<char* const> words);

/// Behind an error of parsing: what each word that was not taken probably means.
void TellMeant(const CLI::App& app, std::ostream& err);

}  // namespace baudgate
