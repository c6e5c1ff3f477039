// The flight recorder of one line and the source of its live traces: keeps the last exchanges as
// they were on the wire, without secrets, and says when they are worth a file. Fed as
// a Tap (gateway/bus/exchange/line.h) and by gateway/lines/line_reporter.cpp, read by
// gateway/outputs/control and Recordings. Sans-I/O: time is an argument. Recordings writes the
// files.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "config/model/line.h"
#include "gateway/base/guarded.h"
#include "gateway/base/worker.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/records/trace/trace_text.h"

namespace baudgate::records {

/// A copy of the recorder at the moment when something went wrong.
struct Recording {
  std::string line;               ///< its name
  std::vector<std::string> head;  ///< TraceHead of the line
  std::string name;               ///< of the device or slave with which it went wrong
  std::string reason;             ///< one word, for the file's name: "offline", "corrupt"
  WallTime at{};
  std::vector<TraceRecord> records;  ///< oldest first
};

class LineRecorder final : public bus::Tap {
 public:
  static constexpr std::size_t kExchanges = 64;
  /// Bytes kept of one exchange and what follows it; the rest is counted only.
  static constexpr std::size_t kMostBytes = 1024;
  /// Pieces and notes kept of it; where bytes come in more, they are put together.
  static constexpr std::size_t kMostItems = 64;
  /// A reason may quote what came back: none is kept for so long after a request with secrets, as
  /// its task may go on with requests that have none.
  static constexpr Duration kNoReasons = 5s;
  /// A line whose last exchange ended so long ago only listens. Its messages are told apart by
  /// silence.
  static constexpr Duration kOnlyListens = 10s;
  static constexpr Duration kSilence = 500ms;
  /// A line that is in trouble for long gives one recording in this time.
  static constexpr Duration kBetweenRecordings = 1min;

  /// Called on the line's thread; must not block. Empty: recordings are not wanted.
  using Sink = std::function<void(Recording)>;
  /// `line` outlives the recorder; `first_device`: the index of line.devices[0] in the store.
  LineRecorder(const config::Line& line, std::uint32_t first_device, Sink sink);

  // The line's thread.
  /// The secret bytes of `request` are masked, and with them everything received until the next
  /// request: an echo may bring them back, whole, damaged, late or in pieces.
  void OnSent(std::uint32_t device, const protocols::Request& request, Now now) override;
  void OnReceived(View bytes, Now now) override;
  void OnExchangeEnd(std::uint32_t device, const bus::ExchangeEnd& end, Now now) override;
  void OnDeviceState(std::uint32_t device, bus::DeviceState to, const std::string& reason,
                     Now now) override;
  /// A change of the port, in a few words; an exchange under way is over.
  void OnPort(const std::string& text, Now now);

  // Any thread.
  /// What people call the device: "feeder-1", or "slave-17" of a slave that only routes reach.
  std::string NameOf(std::uint32_t device) const;
  /// Gets every record from now on, until the caller lets go of it.
  std::shared_ptr<TraceQueue> Subscribe(std::function<void()> wake);
  std::vector<TraceRecord> Recorded() const;

 private:
  static constexpr std::uint32_t kNoDevice = ~0U;

  struct Item {
    TraceRecord::Kind kind = TraceRecord::Kind::note;
    Outcome outcome = Outcome::none;
    std::uint16_t begin = 0;  // of its bytes, or its text, in Exchange::bytes
    std::uint16_t end = 0;
    std::uint32_t device = kNoDevice;
    WallTime at{};
    Duration round_trip{};
  };
  /// One request and everything up to the next one; on a line that only listens, one message. Kept
  /// as bytes: most are never looked at.
  struct Exchange {
    std::vector<Item> items;
    Bytes bytes;               // and texts
    std::vector<bool> masked;  // as bytes, as far as there are secrets
    std::size_t on_wire = 0;   // of bytes, without texts
    std::size_t left_out = 0;
    void Clear();
    void Keep(Item item, View content);
  };

  Exchange& Begin() BAUDGATE_REQUIRES(mutex_);
  Exchange& Current() BAUDGATE_REQUIRES(mutex_) { return count_ == 0 ? Begin() : ring_[newest_]; }
  /// Begins a new entry for what is received on a line that only listens.
  void BeginUnasked(Now now) BAUDGATE_REQUIRES(mutex_);
  void Add(const Item& item, std::string_view text) BAUDGATE_REQUIRES(mutex_);
  void AddBytes(const Item& item, View bytes, const std::vector<bool>& masked)
      BAUDGATE_REQUIRES(mutex_);
  bool IsQuotable(Now now) const BAUDGATE_REQUIRES(mutex_);
  TraceRecord Show(const Item& item, View content, const std::vector<bool>& masked) const;
  void Tell(const TraceRecord& record) BAUDGATE_REQUIRES(mutex_);
  std::vector<TraceRecord> Copy() const BAUDGATE_REQUIRES(mutex_);
  std::optional<Recording> Save(std::uint32_t device, const char* reason, Now now)
      BAUDGATE_REQUIRES(mutex_);

  const config::Line& line_;
  const std::uint32_t first_device_;
  const Sink sink_;

  mutable Mutex mutex_;
  std::array<Exchange, kExchanges> ring_ BAUDGATE_GUARDED_BY(mutex_);
  std::size_t newest_ BAUDGATE_GUARDED_BY(mutex_) = 0;              // its place in the ring
  std::size_t count_ BAUDGATE_GUARDED_BY(mutex_) = 0;               // of exchanges kept
  std::uint32_t asked_ BAUDGATE_GUARDED_BY(mutex_) = kNoDevice;     // whose exchange is under way
  bool masks_received_ BAUDGATE_GUARDED_BY(mutex_) = false;         // the last request had secrets
  std::optional<Instant> ended_ BAUDGATE_GUARDED_BY(mutex_);        // the last exchange
  std::optional<Instant> received_ BAUDGATE_GUARDED_BY(mutex_);     // the last bytes
  std::optional<Instant> last_secret_ BAUDGATE_GUARDED_BY(mutex_);  // when one was last sent
  std::optional<Instant> saved_ BAUDGATE_GUARDED_BY(mutex_);        // when it last gave a recording
  std::vector<std::weak_ptr<TraceQueue>> readers_ BAUDGATE_GUARDED_BY(mutex_);
};

// Writes what flight recorders hold into files that `baudgate decode` reads. Recordings come from
// LineRecorder on the lines' threads; one thread here does the writing.
class Recordings {
 public:
  static constexpr std::size_t kFilesPerLine = 20;
  /// Recordings that wait for a slow disk; further ones are dropped.
  static constexpr std::size_t kMostWaiting = 16;

  /// config.recordings, else the first folder of $STATE_DIRECTORY with /recordings; empty: nowhere.
  static std::filesystem::path FolderOf(const config::Config& config);

  /// A failed write is tried again after this time.
  static constexpr Duration kAgain = 10s;

  /// `trouble` gets why nothing can be written by now, or an empty text; from the writing thread.
  /// Its end waits until all that waits is written.
  Recordings(std::filesystem::path folder, std::string version,
             std::function<void(const std::string&)> trouble);

  /// From any thread; returns at once.
  void Save(Recording recording);

 private:
  /// As it will be in the folder.
  struct File {
    std::string line;
    std::string name;
    std::string contents;
  };
  void WriteAll();
  void Write(const File& file);
  void DropOldest(const std::string& line) const;

  const std::filesystem::path folder_;
  const std::string version_;
  const std::function<void(const std::string&)> trouble_;
  std::optional<File> failed_;  // the latest that could not be written; of the writing thread
  WorkQueue<Recording> waiting_{kMostWaiting};
  Worker worker_;
};

}  // namespace baudgate::records
