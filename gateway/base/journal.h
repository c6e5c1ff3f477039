// systemd's journal as a place for the log: a datagram for each message, with fields (systemd's
// "Native Journal Protocol").
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/log.h"

namespace baudgate::log {

/// What journald calls it: 3 error, 4 warning, 6 info, 7 debug.
int Priority(Level level);

/// Descriptors that systemd has connected to the journal, as $JOURNAL_STREAM says; not when the
/// variable was only inherited by a program whose output goes elsewhere.
bool IsJournal(int descriptor);

/// "MESSAGE=line bay: device relay: offline\nPRIORITY=4\nLINE=bay\nDEVICE=relay\n…"
std::string JournalMessage(Level level, const About& about, const std::string& text);

class Journal {
 public:
  explicit Journal(std::string socket);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Does not block; thread-safe. False: there is no journal, or its socket is full.
  bool Send(Level level, const About& about, const std::string& text) const;

 private:
  const std::string path_;
  const int socket_;
};

}  // namespace baudgate::log
