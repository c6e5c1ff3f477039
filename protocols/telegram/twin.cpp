// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/twin.h"

#include <cmath>

#include "protocols/telegram/description.h"
#include "protocols/telegram/field.h"

namespace baudgate::protocols::telegram {
namespace {

/// Returns the bytes of the first code that means `reason`. Empty: the field has no such code.
std::optional<Bytes> CodeFor(const Telegram& telegram, const Element& field, Reason reason) {
  const auto codes = telegram.codes.find(field.name);
  if (codes == telegram.codes.end()) return std::nullopt;
  for (const auto& [code, meaning] : codes->second) {
    if (meaning->quality.reason != reason) continue;
    const Value number = NumberOf(field.format, code);
    const auto written =
        HasValue(number) ? EncodeField(field.format, number) : Result<Bytes>(Error{});
    return written ? *written : ToBytes(code);
  }
  return std::nullopt;
}

/// Returns a value of the field that is not `text`: another of its codes, preferably a good one.
Value OtherThan(const Telegram& telegram, const Element& field, const std::string& text) {
  Value other;
  if (const auto codes = telegram.codes.find(field.name); codes != telegram.codes.end()) {
    for (const auto& [code, meaning] : codes->second) {
      if (code == text || meaning->busy || IsBad(meaning->quality)) continue;
      if (HasValue(other) && !IsGood(meaning->quality)) continue;
      other = code;
    }
  }
  if (HasValue(other)) return other;
  if (field.format.kind == Format::Kind::byte) return std::string(text == "0x00" ? "0x01" : "0x00");
  other = std::string(text == "0" ? "1" : "0");
  return other;
}

Value WithBits(const Value& whole, const ReadPlace& place, const Value& bits) {
  const auto* old = std::get_if<std::int64_t>(&whole);
  std::uint64_t raw = old != nullptr ? static_cast<std::uint64_t>(*old) : 0;
  const std::uint64_t mask = (place.bits >= 64 ? 0 : std::uint64_t{1} << place.bits) - 1;
  const double number = ToDouble(bits);
  const auto wanted = number >= 1 && number < 1e15 ? static_cast<std::uint64_t>(number) & mask : 0;
  raw = (raw & ~(mask << place.bit)) | wanted << place.bit;
  return static_cast<std::int64_t>(raw);
}

}  // namespace

TelegramTwin::TelegramTwin(const config::Device& device, TwinValues& values)
    : values_(values),
      description_(DescriptionOf(device.options)),
      bound_(BoundOf(ReadSettings(device.options), device.address)) {
  for (const config::Point& point : device.points) {
    auto read =
        point.access != config::Access::write ? ParseRead(point) : Result<ReadPlace>(Error{});
    auto write = point.access != config::Access::read ? ParseWrite(point) : Result<Call>(Error{});
    reads_.push_back(read ? std::optional(std::move(*read)) : std::nullopt);
    writes_.push_back(write ? std::optional(std::move(*write)) : std::nullopt);
  }
  if (!description_) return;
  std::vector<std::optional<Call>> calls;
  for (const auto& read : reads_) {
    calls.push_back(read ? std::optional(read->call) : std::nullopt);
  }
  read_ = Questions(*description_, bound_, calls);
  written_ = Questions(*description_, bound_, writes_);
}

void TelegramTwin::ReplyAs(std::string_view address) { reply_as_ = AddressValue(address); }

bool TelegramTwin::IsForMe(const Bound& sent) const {
  for (const std::string_view name : {kAddress, kPassword}) {
    const auto said = sent.find(name);
    const auto own = bound_.find(name);
    if (said != sent.end() && own != bound_.end() && !SameValue(said->second, own->second)) {
      return false;
    }
  }
  return true;
}

/// Returns the fields of this telegram, and of the telegrams that go before it as they were sent
/// last, because a selected channel stays selected.
Bound TelegramTwin::Told(std::size_t telegram, const Bound& sent) {
  told_.insert_or_assign(telegram, sent);
  Bound told = sent;
  for (const std::size_t before : description_->telegrams[telegram].before) {
    told.insert(told_[before].begin(), told_[before].end());
  }
  return told;
}

void TelegramTwin::Write(std::size_t telegram, const Bound& sent) {
  for (std::size_t i = 0; i < writes_.size(); ++i) {
    if (!written_.IsAsked(i, telegram, sent)) continue;
    const auto value = sent.find(kValue);
    const Value written = value == sent.end() ? Value(true) : value->second;
    values_.Set(i, written);
    if (value == sent.end() || !reads_[i] || reads_[i]->select != ReadPlace::Select::whole)
      continue;
    // Other points that read the same field get the value as well.
    for (std::size_t other = 0; other < reads_.size(); ++other) {
      if (other != i && reads_[other] && *reads_[other] == *reads_[i]) values_.Set(other, written);
    }
  }
}

Bytes TelegramTwin::Answer(View request, Instant now) {
  const auto sent = description_ ? description_->Recognise(request) : std::nullopt;
  if (!sent || !IsForMe(sent->values)) return {};
  const Bound told = Told(sent->telegram, sent->values);
  Write(sent->telegram, told);
  const bool answers = !description_->telegrams[sent->telegram].receive.empty();
  return answers ? Compose(sent->telegram, told, now) : Bytes();
}

void TelegramTwin::PutValue(const Telegram& telegram, const Example& usual, const Element& element,
                            std::size_t point, Instant now, Bound& values) const {
  const ReadPlace& place = *reads_[point];
  const Value value = values_.Get(point, now);
  if (!HasValue(value)) return;
  if (place.select == ReadPlace::Select::equal) {
    const Value other = OtherThan(telegram, element, place.equal);
    const bool is_equal = ToDouble(value) != 0;
    if (is_equal) {
      values.insert_or_assign(element.name, place.equal);
    } else {
      values.insert_or_assign(element.name, other);
    }
    return;
  }
  if (place.select == ReadPlace::Select::bits) {
    auto whole = values.find(element.name);
    if (whole == values.end()) {
      const auto said = usual.values.find(element.name);
      whole =
          values.emplace(element.name, said == usual.values.end() ? Value{} : said->second).first;
    }
    whole->second = WithBits(whole->second, place, value);
    return;
  }
  const Value shown = Nearest(element.format, value);
  if (EncodeField(element.format, shown)) values.insert_or_assign(element.name, shown);
}

Bytes TelegramTwin::Compose(std::size_t number, const Bound& sent, Instant now) const {
  const Telegram& telegram = description_->telegrams[number];
  const Example& example = telegram.ExampleFor(sent);
  for (const Form& form : telegram.receive) {
    const Match usual = MatchAll(form, example.receive, {});
    if (usual.kind != Match::Kind::whole) continue;
    Bound values;
    std::vector<std::pair<std::size_t, Bytes>> codes;
    for (std::size_t i = 0; i < form.pattern.elements.size(); ++i) {
      const Element& element = form.pattern.elements[i];
      if (!element.is_field() || element.name.empty()) continue;
      if (const auto repeated = sent.find(element.name); repeated != sent.end()) {
        values.insert_or_assign(element.name, repeated->second);
      } else if (const auto own = bound_.find(element.name); own != bound_.end()) {
        values.insert_or_assign(element.name, own->second);
      }
      if (element.name == kAddress && reply_as_) values.insert_or_assign(element.name, *reply_as_);
      for (std::size_t point = 0; point < reads_.size(); ++point) {
        const auto& read = reads_[point];
        if (!read_.IsAsked(point, number, sent) || read->field != element.name) continue;
        const Value value = values_.Get(point, now);
        const double number = ToDouble(value);
        const bool is_code =
            HasValue(value) && element.format.is_number() && !std::isfinite(number);
        const auto code =
            CodeFor(telegram, element, number < 0 ? Reason::under_range : Reason::over_range);
        if (is_code && code) {
          codes.emplace_back(i, *code);
        } else {
          PutValue(telegram, example, element, point, now, values);
        }
      }
    }
    Match rest = usual;
    for (const auto& [index, code] : codes) rest.parts[index] = code;
    const auto bytes = Build(form, values, &rest);
    return bytes ? *bytes : Bytes();
  }
  return {};
}

bool TelegramTwin::Raise(const DeviceEvent&, Now now) {
  if (!description_ || !description_->listens()) return false;
  constexpr std::size_t kMostSaid = 100;
  for (std::size_t i = 0; i < description_->telegrams.size(); ++i) {
    if (description_->telegrams[i].listen && said_.size() < kMostSaid)
      said_.push_back(Compose(i, {}, now.instant));
  }
  return true;
}

Bytes TelegramTwin::Say(Instant) {
  if (said_.empty()) return {};
  Bytes next = std::move(said_.front());
  said_.pop_front();
  return next;
}

}  // namespace baudgate::protocols::telegram
