// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/identification.h"

#include "protocols/common/designation.h"
#include "protocols/telegram/probes.h"

namespace baudgate::protocols::telegram {

Identification::Identification(const Description& description, const config::Identity& identity)
    : description_(description), identity_(identity), telegram_(IdentityTelegram(description)) {}

void Identification::OnReply(const Reply& reply) {
  const auto name = reply.fields.find(description_.telegrams[*telegram_].identity);
  if (name == reply.fields.end()) return;
  trouble_ = JudgeName(identity_, name->second.text);
  asked_ = named_ = true;
  nameless_.Forget();
}

void Identification::OnReconnect() {
  asked_ = named_ = false;
  nameless_.Forget();
}

}  // namespace baudgate::protocols::telegram
