// `LineRecorder` is the flight recorder of one line and the source of its live traces: it contains
// the last exchanges as they were on the wire, without secrets, and decides when they are saved to
// a file. gateway/bus/exchange/line.h calls it as a Tap, gateway/lines/line_reporter.cpp reports
// states, and gateway/outputs/control reads it. No I/O; it reads no clock.
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

struct Recording {
  std::string line;
  std::vector<std::string> head;  ///< TraceHead of the line
  std::string name;               ///< name of the device or slave that failed
  std::string reason;             ///< one word for the file name: "offline", "corrupt"
  WallTime at{};
  std::vector<TraceRecord> records;  ///< oldest first
};

class LineRecorder final : public bus::Tap {
 public:
  static constexpr std::size_t kExchanges = 64;
  /// The limit of stored bytes of one Exchange, which ends before the next request. Further bytes
  /// are only counted.
  static constexpr std::size_t kMostBytes = 1024;
  /// The limit of stored pieces and notes of one exchange. If it is reached, further received bytes
  /// are added to the last piece.
  static constexpr std::size_t kMostItems = 64;
  /// For this time after a request with secrets, the reasons of failures are left out: a reason can
  /// quote the reply, and later requests of the same task can have no secrets of their own.
  static constexpr Duration kNoReasons = 5s;
  /// If a line's last exchange ended longer ago than this, the line counts as only listening, and
  /// pauses of kSilence separate its messages.
  static constexpr Duration kOnlyListens = 10s;
  static constexpr Duration kSilence = 500ms;
  /// A line makes at most one recording in this time, however long its trouble lasts.
  static constexpr Duration kBetweenRecordings = 1min;

  /// Called on the line's thread with a new recording; must not block. Empty: no recordings are
  /// made.
  using Sink = std::function<void(Recording)>;
  /// `line` must outlive this object. `first_device`: the number of line.devices[0] in the point
  /// store.
  LineRecorder(const config::Line& line, std::uint32_t first_device, Sink sink);

  // The functions below are for the line's thread.

  /// Masks the secret bytes of `request`, and everything that is received until the next request,
  /// because an echo can repeat them: whole, damaged, late or in pieces.
  void OnSent(std::uint32_t device, const protocols::Request& request, Now now) override;
  void OnReceived(View bytes, Now now) override;
  void OnExchangeEnd(std::uint32_t device, const bus::ExchangeEnd& end, Now now) override;
  void OnDeviceState(std::uint32_t device, bus::DeviceState to, const std::string& reason,
                     Now now) override;
  /// Records a change of the port, in a few words. An exchange under way counts as ended.
  void OnPort(const std::string& text, Now now);

  // The functions below can be called on any thread.

  /// Returns the name of the device for users: "feeder-1", or "slave-17" for a slave that only
  /// transparent routes address.
  std::string NameOf(std::uint32_t device) const;
  /// Returns a queue that receives every record from now on, until the caller releases the queue.
  /// The queue drops records beyond TraceQueue::kMostRecords.
  std::shared_ptr<TraceQueue> Subscribe(std::function<void()> wake);
  std::vector<TraceRecord> Recorded() const;

 private:
  static constexpr std::uint32_t kNoDevice = ~0U;

  struct Item {
    TraceRecord::Kind kind = TraceRecord::Kind::note;
    Outcome outcome = Outcome::none;
    std::uint16_t begin = 0;
    std::uint16_t end = 0;
    std::uint32_t device = kNoDevice;
    WallTime at{};
    Duration round_trip{};
  };
  /// One request and all bytes up to the next request, or one message if the line only listens. It
  /// has bytes, not text, because most exchanges are never shown.
  struct Exchange {
    std::vector<Item> items;
    Bytes bytes;               // bytes of the wire, and the texts of notes
    std::vector<bool> masked;  // true: secret; parallel to `bytes`, up to the last secret byte
    std::size_t on_wire = 0;   // how many of `bytes` were on the wire
    std::size_t left_out = 0;
    void Clear();
    void Keep(Item item, View content);
  };

  Exchange& Begin() BAUDGATE_REQUIRES(mutex_);
  Exchange& Current() BAUDGATE_REQUIRES(mutex_) { return count_ == 0 ? Begin() : ring_[newest_]; }
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
  std::size_t newest_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::size_t count_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::uint32_t asked_ BAUDGATE_GUARDED_BY(mutex_) = kNoDevice;
  // True: received bytes are masked, because the last request had secrets.
  bool masks_received_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::optional<Instant> ended_ BAUDGATE_GUARDED_BY(mutex_);
  std::optional<Instant> received_ BAUDGATE_GUARDED_BY(mutex_);
  std::optional<Instant> last_secret_ BAUDGATE_GUARDED_BY(mutex_);
  std::optional<Instant> saved_ BAUDGATE_GUARDED_BY(mutex_);
  std::vector<std::weak_ptr<TraceQueue>> readers_ BAUDGATE_GUARDED_BY(mutex_);
};

// `Recordings` writes recordings to files that `baudgate decode` reads. LineRecorder passes
// recordings on the lines' threads; one thread writes the files.
class Recordings {
 public:
  static constexpr std::size_t kFilesPerLine = 20;
  /// The number of recordings that can wait for a slow disk. Further recordings are dropped.
  static constexpr std::size_t kMostWaiting = 16;

  /// Returns config.recordings if it is given, else the folder `recordings` in the first folder of
  /// $STATE_DIRECTORY; empty: there is no folder.
  static std::filesystem::path FolderOf(const config::Config& config);

  static constexpr Duration kAgain = 10s;

  /// `trouble` is called on the writing thread with the reason why nothing can be written, and with
  /// an empty text when writing works again. The destructor waits until all waiting recordings are
  /// written.
  Recordings(std::filesystem::path folder, std::string version,
             std::function<void(const std::string&)> trouble);

  /// Can be called on any thread; returns at once.
  void Save(Recording recording);

 private:
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
  // The latest file that could not be written. For the writing thread only.
  std::optional<File> failed_;
  WorkQueue<Recording> waiting_{kMostWaiting};
  Worker worker_;
};

}  // namespace baudgate::records
