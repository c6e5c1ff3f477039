// The words of register lists: what their columns, types, tables and permissions are called.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace baudgate {

enum class ListColumn {
  name,
  address,
  type,
  unit,
  scale,
  access,
  table,
  group,
  description,
  example,
  order
};

/// "Data Type" → type. Case, blanks and marks do not count.
std::optional<ListColumn> ColumnNamed(std::string_view header);

/// "U16", "WORD", "unsigned int 16" → "uint16"; "STRING(16)", "char[16]" → "string(16)", and
/// "string" if no length stands there; "Date" → "DATE".
std::optional<std::string> FormNamed(std::string_view text);

/// "Holding Register", "FC3", "4x" → "holding".
std::optional<std::string> TableNamed(std::string_view text);

/// "R/W", "read-write" → "rw".
std::optional<std::string> AccessNamed(std::string_view text);

/// "low word first", "word swap" → "CDAB". Empty: "little endian" too, which means CDAB to some
/// manuals and DCBA to others.
std::optional<std::string> OrderNamed(std::string_view text);

/// How many registers a form takes; 1 of bits.
std::size_t RegistersOf(const std::string& form);
/// Characters of "string(16)".
std::size_t LengthOf(const std::string& form);
/// Two registers with a time or a date of IEC 61131-3.
bool IsTimeForm(std::string_view form);

/// As a text stands in YAML.
std::string InQuotes(std::string_view text);

}  // namespace baudgate
