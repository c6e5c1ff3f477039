// How far a write has come on its way from the gate to its end, and how it may end from there. Its
// client is told, and the audit records, one of these words.
//
//   state          so far                                         may end as
//   asked          let through by the gate                        denied, busy, not_sent
//   queued         waits for its line, or for its next points     denied, refused, busy, not_sent
//   sent           a request that may have written has gone out   ok, refused, busy, unknown
//   reading_back   confirmed by the device                        ok, differs; not_sent: the points
//                                                                 behind those
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gateway/base/write_result.h"

namespace baudgate {

enum class WriteState : std::uint8_t { asked, queued, sent, reading_back, ended };
inline constexpr std::size_t kWriteStates = 5;

/// Forward only, except for the next points of a command, and for a request that never left this
/// machine; from `sent` to `sent` is a repetition.
constexpr bool MayFollow(WriteState from, WriteState to) {
  switch (to) {
    case WriteState::asked:
      return false;
    case WriteState::queued:
      return from != WriteState::queued && from != WriteState::ended;
    case WriteState::sent:
      return from == WriteState::queued || from == WriteState::sent;
    case WriteState::reading_back:  // at once where points are only read
    case WriteState::ended:
      return from < to;
  }
  return false;
}

constexpr bool MayEnd(WriteState state, WriteEnd end) {
  switch (end) {
    case WriteEnd::ok:
      return state == WriteState::sent || state == WriteState::reading_back;
    case WriteEnd::differs:
      return state == WriteState::reading_back;
    case WriteEnd::refused:
      return state == WriteState::queued || state == WriteState::sent;
    case WriteEnd::busy:
      return state <= WriteState::sent;
    case WriteEnd::unknown:
      return state == WriteState::sent;
    case WriteEnd::not_sent:
      return state <= WriteState::queued || state == WriteState::reading_back;
    case WriteEnd::denied:
      return state <= WriteState::queued;
  }
  return false;
}

/// The end of a write whose result is not known.
constexpr WriteEnd EndUnheard(bool sent) { return sent ? WriteEnd::unknown : WriteEnd::not_sent; }

}  // namespace baudgate
