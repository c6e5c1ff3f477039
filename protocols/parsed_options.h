// The options of a device as its protocol uses them. Protocol::parse makes them once a device;
// every function of the protocol that depends on options gets them. Only the protocol knows their
// type:
//
//   ParsedOptions::Of(Settings{.checksum = true})      in `parse`
//   options.As<Settings>().checksum                    in `expect`
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

namespace baudgate {

class ParsedOptions {
 public:
  /// For a protocol without options.
  ParsedOptions() = default;

  template <typename Settings>
  static ParsedOptions Of(Settings settings) {
    ParsedOptions options;
    options.settings_ = std::make_shared<const Settings>(std::move(settings));
    return options;
  }

  /// `Settings`: the type that the protocol's `parse` has given to Of.
  template <typename Settings>
  const Settings& As() const {
    return *static_cast<const Settings*>(settings_.get());
  }

 private:
  std::shared_ptr<const void> settings_;
};

}  // namespace baudgate
