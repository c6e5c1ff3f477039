// `Scanner` executes a scan: it listens, sends the questions of the plan
// (gateway/tools/scan/plan.h), judges the replies (gateway/tools/scan/judge.h), and repeats a
// question if its reply is not clear. It sends only what the ScanRule of each protocol lists. The
// caller provides the port and the clock (`Wire`), and receives what was found (`Watcher`).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/tools/scan/judge.h"
#include "gateway/tools/scan/plan.h"

namespace baudgate::scan {

/// An open port, implemented by the caller. An error of Listen or Ask ends the scan.
class Wire {
 public:
  virtual ~Wire() = default;
  virtual Status Apply(const config::SerialSettings& serial) = 0;
  virtual Result<Gathered> Listen(Duration time) = 0;
  /// Waits until the line is quiet, sends `request`, and returns the received bytes: waits
  /// `patience` after the last character of the request for the first byte, then until no byte has
  /// come for `gap`.
  virtual Result<Gathered> Ask(View request, Duration patience, Duration gap) = 0;
  virtual Instant Now() = 0;
};

struct Progress {
  std::string doing{};  ///< present step: "spabus 9600 7E1, address 12"
  std::size_t found = 0;
  Duration left{};
};

class Watcher {
 public:
  virtual ~Watcher() = default;
  virtual void OnProgress(const Progress& progress) = 0;
  virtual void OnFound(const Found& found) = 0;
  /// Returns whether the scan is allowed to send although another master is active. `who`: a
  /// sentence about the master, without a full stop.
  virtual bool MayTalk(const std::string& who) = 0;
};

class Scanner {
 public:
  /// All references must outlive this object.
  Scanner(const Wish& wish, const ProfileNames& profiles, Wire& wire, Watcher& watcher);

  /// Executes the scan; must be called only once. The report contains what was found, also after an
  /// error.
  Status Run();
  const Report& report() const { return report_; }

 private:
  struct Asked {
    std::size_t tongue = 0;
    config::SerialSettings serial{};
    unsigned address = 0;
    std::size_t mode = 0;
    std::size_t question = 0;
    Duration patience{};
  };

  bool is_over() const { return !report_.ended; }
  const Tongue& TongueAt(const Asked& asked) const { return wish_.tongues[asked.tongue]; }
  void End() { report_.ended = false; }
  bool Set(const config::SerialSettings& serial);
  void SetBack(const config::SerialSettings& serial);
  void Listen();
  void Sweep(const scan::Sweep& sweep, Duration behind);
  bool IsKnown(std::size_t tongue, unsigned address) const;
  void Look(Asked asked, std::uint32_t finds);
  Verdict Exchange(const Asked& asked);
  Verdict ExchangeOnce(const Asked& asked);
  void CheckLate(std::optional<Asked> late);
  bool OnVerdict(const Asked& asked, Verdict verdict);
  void TakeInOwnFormat(Asked asked, Verdict verdict);
  bool TryFormats(const Asked& asked, const std::string& why);
  void OnGarbled(const Asked& asked);
  void Take(const Asked& asked, protocols::Sighting sighting, std::vector<std::string> remarks);
  bool IsShared(const Asked& asked, const protocols::Sighting& sighting);
  void AskName(const Asked& asked, protocols::Sighting& sighting);
  void Keep(Found found);
  void TellForeign(const std::string& who);
  void Finish();

  const Wish& wish_;
  const ProfileNames& profiles_;
  Wire& wire_;
  Watcher& watcher_;
  Report report_;
  Status status_;
  /// True: another master is active, and the user has allowed the scan to send.
  bool traffic_ = false;
  std::set<std::string> refused_;  ///< serial settings that the port does not support
  std::set<std::pair<std::string, unsigned>> known_;  ///< protocol and address of found devices
  std::vector<Found> doubtful_;  ///< addresses from which only damaged replies came so far
  std::vector<config::SerialSettings> answered_;
  std::optional<Asked> last_;
  std::optional<Asked> previous_;  ///< the last question before last_ that went to another address
  bool checking_late_ = false;
  Instant limit_{};
};

}  // namespace baudgate::scan
