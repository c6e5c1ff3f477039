// A golden transcript as read from its file, before it is played; the format is in transcript.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "protocols/protocol.h"

namespace baudgate {

/// Bytes of a reply that come in one go.
struct TranscriptPiece {
  Bytes bytes;
  bool after_silence = false;  ///< a time stood before it
  Duration silence{};          ///< that time
};

/// One request and what came of it.
struct TranscriptStep {
  int line = 0;
  std::optional<protocols::Task> task;  ///< begins here: a write, with a raw value, or events
  bool unasked = false;          ///< nothing is asked: `reply` is what the device says by itself
  std::optional<Bytes> request;  ///< nothing: the write must end without one
  std::vector<TranscriptPiece> reply;
  Outcome outcome = Outcome::ok;
  std::vector<std::string> values;  ///< "name value quality", "event 0 1 12.345s"
};

struct TranscriptScript {
  config::Line line;
  config::Device device;
  std::vector<TranscriptStep> steps;
};

/// What is not understood is a GoogleTest failure at its line.
TranscriptScript ReadTranscript(const protocols::Protocol& protocol, const std::string& path);

}  // namespace baudgate
