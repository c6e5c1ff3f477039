// A subscriber to every topic whose type is announced in discovery, whoever publishes it: samples
// are decoded by that type and come as names and texts. Used by `baudgate watch --any`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/outputs/dds/participant_options.h"

namespace baudgate::dds {

struct AnyField {
  std::string name;  ///< within others: "position.x", "samples[3]"
  std::string text;
  enum class Form : std::uint8_t {
    number,  ///< finite, and written as JSON has it; booleans too
    text,
    none,  ///< NaN, infinite, or of a type that is not shown: for people only
  } form = Form::number;
};

struct AnySample {
  std::string topic;
  std::string type;
  std::vector<AnyField> fields;  ///< in the order of the type, 1,000 at most
};

/// Called one at a time, on threads of the library; they must not call the subscriber.
struct AnyCallbacks {
  std::function<void(const AnySample&)> on_sample;
  /// A topic is read from now on, or cannot be: then `why` says so.
  std::function<void(const std::string& topic, const std::string& type, const std::string& why)>
      on_topic;
};

class AnySubscriber {
 public:
  static Result<std::unique_ptr<AnySubscriber>> Create(const ParticipantOptions& options,
                                                       AnyCallbacks callbacks);
  ~AnySubscriber();  ///< no callback runs after it

  /// At most so many topics are read; of those beyond on_topic tells.
  static constexpr std::size_t kMostTopics = 100;

 private:
  struct Impl;
  explicit AnySubscriber(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace baudgate::dds
