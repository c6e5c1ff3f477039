// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/expect.h"

#include <algorithm>

#include "protocols/telegram/field.h"

namespace baudgate::protocols::telegram {
namespace {

void AddForm(const Form& form, std::size_t most, Awaited& awaited, Expectation& expect) {
  const auto [least, longest] = form.pattern.usual_sizes();
  expect.shapes.push_back({static_cast<int>(awaited.forms.size()), least,
                           form.size_at ? most : longest.value_or(most)});
  awaited.forms.push_back(&form);
}

/// Where the password stands in the request, and the check value over it.
void AddSecrets(const Form& form, const Match& match, Expectation& expect) {
  if (!form.pattern.Has(kPassword)) return;
  std::size_t at = 0;
  for (std::size_t i = 0; i < match.parts.size(); at += match.parts[i].size(), ++i) {
    const Element& element = form.pattern.elements[i];
    if (!element.is_field() || match.parts[i].empty()) continue;
    if (element.name == kPassword || element.name == kChecksum) {
      expect.secrets.emplace_back(at, match.parts[i].size());
    }
  }
}

/// As it stands in the answer: only where all forms write it alike.
Bytes AddressIn(const Telegram& telegram, const Bound& known) {
  const auto address = known.find(kAddress);
  if (address == known.end() || telegram.receive.empty()) return {};
  Bytes bytes;
  for (const Form& form : telegram.receive) {
    const Element* element = form.pattern.Find(kAddress);
    const auto field =
        element != nullptr ? EncodeField(element->format, address->second) : Result<Bytes>(Bytes());
    if (!field || field->empty() || (!bytes.empty() && bytes != *field)) return {};
    bytes = *field;
  }
  return bytes;
}

}  // namespace

Expectation Expect(View request, const Settings& settings) {
  Expectation expect;
  auto awaited = std::make_shared<Awaited>();
  awaited->description = settings.description;
  if (!awaited->description) return expect;
  const Description& description = *awaited->description;
  expect.max_bytes = description.most;
  if (request.empty()) {
    for (const Telegram& telegram : description.telegrams) {
      if (telegram.send) AddForm(*telegram.send, description.most, *awaited, expect);
    }
    expect.forms = std::move(awaited);
    return expect;
  }
  const auto sent = description.Recognise(request);
  if (!sent) {
    expect.repeatable = false;
    return expect;
  }
  const Telegram& telegram = description.telegrams[sent->telegram];
  for (const auto* forms : {&telegram.receive, &telegram.refused}) {
    for (const Form& form : *forms) AddForm(form, description.most, *awaited, expect);
  }
  awaited->known = sent->values;
  expect.repeatable = telegram.may_repeat();
  if (telegram.receive.empty()) expect.reply = Expectation::Reply::none;
  expect.address = AddressIn(telegram, sent->values);
  AddSecrets(*telegram.send, sent->match, expect);
  expect.mirrors = std::ranges::any_of(telegram.receive, [&](const Form& form) {
    return MatchAll(form, request, sent->values).kind == Match::Kind::whole;
  });
  expect.forms = std::move(awaited);
  return expect;
}

Expectation ExpectUnasked(const Settings& settings) {
  Expectation expect;
  expect.reply = Expectation::Reply::standing;
  auto awaited = std::make_shared<Awaited>();
  awaited->description = settings.description;
  if (!awaited->description) return expect;
  expect.max_bytes = awaited->description->most;
  awaited->known = BoundOf(settings, {});
  for (const Telegram& telegram : awaited->description->telegrams) {
    if (!telegram.listen) continue;
    for (const Form& form : telegram.receive) {
      AddForm(form, awaited->description->most, *awaited, expect);
    }
  }
  expect.forms = std::move(awaited);
  return expect;
}

}  // namespace baudgate::protocols::telegram
