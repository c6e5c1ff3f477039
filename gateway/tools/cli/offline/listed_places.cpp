// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/listed_places.h"

#include <algorithm>
#include <vector>

#include "gateway/base/spelling.h"
#include "gateway/tools/cli/offline/listed_words.h"

namespace baudgate {
namespace {

std::size_t EndOfRegisters(const ListedPoint& point) {
  return std::size_t{point.address} + RegistersOf(point.form);
}

std::string RegistersText(const ListedPoint& point) {
  const std::string first = point.table + " " + std::to_string(point.address);
  const std::size_t last = EndOfRegisters(point) - 1;
  return last == point.address ? first : first + "…" + std::to_string(last);
}

}  // namespace

void CheckPlaces(const std::string& file, RegisterList& list) {
  std::vector<const ListedPoint*> points;
  for (const ListedPoint& point : list.points) points.push_back(&point);
  std::ranges::stable_sort(points, [](const ListedPoint* a, const ListedPoint* b) {
    return a->table != b->table ? a->table < b->table : a->address < b->address;
  });
  const ListedPoint* before = nullptr;  // the one of its table that reaches farthest
  for (const ListedPoint* point : points) {
    const bool shared = before != nullptr && before->table == point->table &&
                        point->address < EndOfRegisters(*before);
    if (shared) {
      const bool same =
          before->address == point->address && EndOfRegisters(*before) == EndOfRegisters(*point);
      const std::string text = file + ":" + std::to_string(point->line) + ": " +
                               config::Quoted(point->name) + " (" + RegistersText(*point) + ") ";
      const std::string other =
          config::Quoted(before->name) + " in line " + std::to_string(before->line);
      if (same) {
        list.warnings.push_back(text + "reads the same as " + other);
      } else {
        list.errors.push_back(text + "overlaps " + other + " (" + RegistersText(*before) +
                              "); one of their registers or types is wrong");
      }
    }
    const bool farther = before == nullptr || before->table != point->table ||
                         EndOfRegisters(*point) > EndOfRegisters(*before);
    if (farther) before = point;
  }
}

}  // namespace baudgate
