// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/tools/scan/bench.h"

#include "config/profile.h"
#include "protocols/all_protocols.h"

namespace baudgate::scan {

/// Appends what the port receives within `window` from the second master and the simulated device
/// that answers it. Returns true if the master sent anything.
bool Bench::TakeMaster(Duration window, Bytes& heard) {
  bool spoke = false;
  for (; master && next_ < now_ + window; next_ += master->every) {
    if (next_ < now_) continue;
    Append(heard, View(FromWireBits(ToWire(master->request, master->serial), serial_).bytes));
    TwinBus::Answer answer = bus.Ask(master->request, master->serial, next_);
    if (SameWire(master->serial, serial_)) Append(heard, View(answer.heard.bytes));
    spoke = true;
  }
  return spoke;
}

Result<Gathered> Bench::Ask(View request, Duration patience, Duration gap) {
  Gathered gathered;
  gathered.early = std::exchange(late_, {});
  if (stop_after && sent.size() >= *stop_after) {
    gathered.stopped = true;
    return gathered;
  }
  sent.emplace_back(Bytes(request.begin(), request.end()), serial_);
  const Duration sending = static_cast<Duration::rep>(request.size()) * serial_.CharacterTime();
  Bytes meanwhile;
  const bool collided = TakeMaster(sending, meanwhile);
  now_ += sending;
  if (echoes) Append(gathered.heard, request);
  Append(gathered.heard, View(meanwhile));
  TwinBus::Answer answer;
  if (!collided) answer = bus.Ask(request, serial_, now_, two);
  if (think > patience && answer.speakers > 0) {
    late_ = answer.heard.bytes;
    answer = {};
  }
  if (answer.speakers == 0) TakeMaster(patience, gathered.heard);
  gathered.damaged = answer.heard.damaged;
  Append(gathered.heard, View(answer.heard.bytes));
  now_ += answer.speakers > 0 ? think +
                                    static_cast<Duration::rep>(answer.heard.bytes.size()) *
                                        serial_.CharacterTime() +
                                    gap
                              : patience;
  return gathered;
}

Wish WishFor(const std::string& protocol) {
  Wish wish;
  for (const bool first : {true, false}) {
    for (const protocols::Protocol* one : protocols::AllProtocols()) {
      if (one->scan == nullptr || one->scan->never_at.empty() != first) continue;
      if (protocol.empty() || one->name == protocol) wish.tongues.push_back(TongueOf(*one));
    }
  }
  return wish;
}

ProfileNames ShippedNames(const Wish& wish) {
  config::Catalog catalog;
  for (const protocols::Protocol* protocol : protocols::AllProtocols()) {
    catalog.protocols[std::string(protocol->name)] = protocol;
  }
  catalog.profile_dirs = {"config/profiles"};
  ProfileNames names;
  for (const Tongue& tongue : wish.tongues) {
    names[std::string(tongue.protocol->name)] = config::NamesAndTitles(catalog, *tongue.protocol);
  }
  return names;
}

}  // namespace baudgate::scan
