// What a batch says of one kind of what a meter keeps: the meter's serial number, and for each part
// how far it was read. 0: the meter does not tell its number.
//
//   9020001 1:0658:1414080200023437:30;2:0000:1314080200023337:2      load profiles 1 and 2
//   9020001 01:31301501….-;07:-.-                                     journals 01 and 07
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace baudgate::protocols::set4tm {

struct KeptParts {
  struct Part {
    std::string name{};
    std::string text{};
  };
  std::uint32_t meter = 0;
  std::vector<Part> parts{};

  std::string Text() const;
  /// Empty: it is no such text.
  static std::optional<KeptParts> Parse(std::string_view said);
};

/// Which meter has left the parts that are kept, and whether it is the one that answers: what was
/// read of another meter says nothing of this one.
class KeptMeter {
 public:
  /// Parts of this meter are kept; 0: it did not tell its number. True: another meter answers.
  bool OnKept(std::uint32_t meter);
  /// Nothing is kept that can be understood.
  void Forget() { kept_.reset(); }
  /// This meter answers. True: what is kept is another's.
  bool OnMeter(std::uint32_t serial);

  /// The meter that answers; 0: it is not known.
  std::uint32_t serial() const { return serial_.value_or(0); }
  /// What is kept may be another meter's: none has told its number yet.
  bool is_open() const { return kept_ && !serial_; }

 private:
  std::optional<std::uint32_t> serial_;  // of the meter that answers
  std::optional<std::uint32_t> kept_;    // of the meter whose parts are kept
};

}  // namespace baudgate::protocols::set4tm
