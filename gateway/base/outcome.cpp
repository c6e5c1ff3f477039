// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/outcome.h"

namespace baudgate {

std::string_view Name(WriteEnd end) {
  switch (end) {
    case WriteEnd::ok:
      return "ok";
    case WriteEnd::differs:
      return "differs";
    case WriteEnd::refused:
      return "refused";
    case WriteEnd::busy:
      return "busy";
    case WriteEnd::unknown:
      return "unknown";
    case WriteEnd::not_sent:
      return "not_sent";
    case WriteEnd::denied:
      return "denied";
  }
  return "?";
}

WriteResult ResultOf(const WriteResult& whole, std::size_t place) {
  if (place < whole.written && whole.end != WriteEnd::differs)
    return {.read_back = whole.read_back};
  if (whole.tried <= whole.written || place < whole.tried) {
    return {.end = whole.end, .reason = whole.reason};
  }
  return {.end = WriteEnd::not_sent,
          .reason = "another point of the same write request was not written"};
}

}  // namespace baudgate
