// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/other_frame.h"

#include <algorithm>
#include <utility>

#include "gateway/diagnosis/damage/changed_bytes.h"

namespace baudgate {

std::optional<Finding> OtherFrame(const Hearing& hearing, View heard) {
  // Binary protocols have the same check value in frames of other forms.
  const bool binary = !std::ranges::all_of(hearing.request, IsPrintable);
  if (binary && !std::ranges::all_of(heard, IsPrintable)) return std::nullopt;
  for (const ForeignRule foreign : hearing.foreign) {
    if (foreign == hearing.protocol->foreign) continue;
    auto cause = foreign(heard);
    if (!cause) continue;
    return Finding{.symptom = Symptom::other_master,
                   .bytes = heard.size(),
                   .cause = std::move(*cause),
                   .remedy =
                       "another master and its devices are on this line: give each protocol "
                       "a line of its own"};
  }
  return std::nullopt;
}

}  // namespace baudgate
