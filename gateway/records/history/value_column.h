// The values of a chunk, each differently by what they are: the numbers that are users' end in the
// docs (docs/history.md); new ones are appended.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gateway/base/value.h"
#include "gateway/records/history/columns.h"

namespace baudgate::history {

enum class ValueCode : std::uint8_t {
  none = 0,     ///< there are none
  whole = 1,    ///< signed: difference to the one before
  counter = 2,  ///< unsigned: difference to the one before
  flag = 3,     ///< 0 or 1
  divided = 4,  ///< number = whole / 10^decimals; differences as of whole
  scaled = 5,   ///< number = whole * 10^-decimals
  single = 6,   ///< differences of the 32 bits of a float
  real = 7,     ///< differences of the 64 bits of a double
  text = 8,     ///< length and bytes
  mixed = 9,    ///< each with the code of its own kind
};

struct ValueForm {
  ValueCode code = ValueCode::none;
  std::uint8_t decimals = 0;
};

/// The shortest that brings back exactly these. All of them are values.
ValueForm FormOf(std::span<const Value> values);
void WriteValues(ValueForm form, std::span<const Value> values, ColumnWriter& to);
/// `count` of them, or fewer where `from` fails.
std::vector<Value> ReadValues(ValueForm form, std::size_t count, ColumnReader& from);

}  // namespace baudgate::history
