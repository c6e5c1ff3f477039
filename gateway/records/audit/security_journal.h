// `SecurityJournal` records logins, refusals and the acts of users in `security.jsonl` in the state
// folder: who, from where, when, with which result. Each row contains the hash of the row before,
// so `baudgate audit --verify` finds a changed, inserted or missing row (VerifyJournal).
//
//   {"n":7,"time":"2026-12-01T08:00:00.000Z","kind":"login","who":"anna","from":"10.0.0.7",
//    "what":"page","result":"ok","prev":"5e88…","hash":"9b74…"}
//
// `hash` is the SHA-256 digest of the row without `hash`. The rows are not signed: a user who can
// write the file can replace all of it. Every row is also in the log of the system, so a log that
// is sent to another machine has the hashes as well.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/base/worker.h"

namespace baudgate::audit {

struct SecurityEvent {
  std::string kind;    ///< login, logout, session, host, command, denied
  std::string who;     ///< user, or client as in WriteCommand::client
  std::string from;    ///< address; empty: this machine
  std::string what;    ///< the act, e.g. "disable bay-1.feeder-1"
  std::string result;  ///< "ok", or why not
};

class SecurityJournal {
 public:
  static constexpr const char* kFile = "security.jsonl";
  static constexpr const char* kOldFile = "security.1.jsonl";
  /// A file that has reached this size becomes kOldFile, and replaces the file before.
  static constexpr std::size_t kMostBytes = std::size_t{4} << 20U;
  static constexpr int kMostInAMinute = 10;
  static constexpr std::size_t kMostHosts = 10'000;
  /// Rows that can wait for the disk. Further rows are only in the log; the file gets their number.
  static constexpr std::size_t kMostWaiting = 1024;

  /// `folder` empty: the rows are only in the log, until SetFolder. The folder is made if it is
  /// missing.
  explicit SecurityJournal(const std::filesystem::path& folder = {});
  /// Writes the rows that wait, but waits one second at most for a disk that hangs.
  ~SecurityJournal();
  SecurityJournal(const SecurityJournal&) = delete;
  SecurityJournal& operator=(const SecurityJournal&) = delete;

  /// Sets the folder if there is none yet. Any thread may call it.
  void SetFolder(const std::filesystem::path& folder);
  /// Adds a row. Any thread may call it; it does not wait for the disk. Texts are cut at 240 bytes,
  /// and control characters in them are replaced (WithoutControls). At most kMostInAMinute
  /// rows with the same kind, user and host are added in a minute; the others are counted, and
  /// their number is a row at the end of the minute. A `command` with the result "ok" is always
  /// added.
  void Note(SecurityEvent event, WallTime now);
  /// Adds a row `host` if the host of the client `peer` has not connected at `place`, such as
  /// "127.0.0.1:502", since the start. Any thread may call it. The journal remembers kMostHosts,
  /// and adds no row for further hosts.
  void NoteHost(const std::string& peer, const std::string& place, WallTime now);
  /// Waits until all rows are on the disk. False: `patience` has passed before.
  bool Flush(Duration patience);

 private:
  struct File;
  void Add(SecurityEvent event, WallTime now);
  // The thread can outlive this object while the disk hangs.
  const std::shared_ptr<File> file_;
  Worker worker_;
};

/// One row of the file, for people.
struct JournalRow {
  std::int64_t number = 0;
  std::string time;
  SecurityEvent event;
};

struct JournalCheck {
  std::vector<JournalRow> rows;
  /// One sentence for each fault: "security.jsonl:12: the row was changed".
  std::vector<std::string> faults;
  std::string last_hash;  ///< hash of the last row: compare it with the log on another machine
};

/// Reads and checks kOldFile and kFile in `folder`. An error: no file can be read.
Result<JournalCheck> VerifyJournal(const std::filesystem::path& folder);

}  // namespace baudgate::audit
