// A golden transcript, parsed from its file. tests/support/transcript.h describes the format.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "protocols/protocol.h"

namespace baudgate {

struct TranscriptPiece {
  Bytes bytes;
  bool after_silence = false;
  Duration silence{};
};

struct TranscriptStep {
  int line = 0;
  std::optional<protocols::Task> task;
  bool unasked = false;          ///< true: no request; the device sends `reply` unasked
  std::optional<Bytes> request;  ///< nothing: the write must end without a request
  std::vector<TranscriptPiece> reply;
  Outcome outcome = Outcome::ok;
  std::vector<std::string> values;
};

struct TranscriptScript {
  config::Line line;
  config::Device device;
  std::vector<TranscriptStep> steps;
};

TranscriptScript ReadTranscript(const protocols::Protocol& protocol, const std::string& path);

}  // namespace baudgate
