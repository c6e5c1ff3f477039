// The fingerprint of the plugin contract. A module that was built against other structs, enums or
// virtual functions than the daemon has another tag, and is refused before anything of it is used.
// Included by the entry of each module and by the module loader only.
//
// The tag is computed by the compiler from Protocol (protocols/protocol.h) and all that can be
// reached from there: types and order of fields, names and values of enumerators, signatures of
// functions. A struct that is not listed below, or with another number of fields than it has, does
// not compile.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>

#include "protocols/protocol.h"

namespace baudgate::abi {

/// A struct with this many fields.
template <std::size_t kCount>
struct Fields {};
/// An interface: its virtual functions, in their order. tests/protocols/contract/abi_test.cpp
/// compares this list with the header.
template <auto... kMethods>
struct Methods {};
/// Of its template arguments alone: std::vector<T>, std::optional<T>.
template <typename... T>
struct Types {};
/// By its name and size alone: types of the standard library and of gateway/base.
struct Leaf {};

Fields<23> ListOf(Protocol*);
Fields<2> ListOf(Doubt*);
Fields<6> ListOf(PduCarrier*);
Fields<7> ListOf(TimingRule*);
Fields<3> ListOf(TimingRule::Span*);
Fields<9> ListOf(OptionSpec*);
Fields<2> ListOf(DecoderSpec*);
Fields<2> ListOf(Query*);
Fields<2> ListOf(PointValue*);
Fields<5> ListOf(Task*);
Fields<8> ListOf(Request*);
Fields<4> ListOf(Reading*);
Fields<2> ListOf(SaidTime*);
Fields<4> ListOf(DeviceEvent*);
Fields<5> ListOf(EventBatch*);
Fields<4> ListOf(PastRecord*);
Fields<4> ListOf(PastValue*);
Fields<7> ListOf(Answer*);
Fields<2> ListOf(DeviceTrouble*);
Fields<5> ListOf(Standing*);
Fields<2> ListOf(Quality*);
Fields<3> ListOf(Shape*);
Fields<8> ListOf(Expectation*);
Fields<4> ListOf(Cut*);
Fields<26> ListOf(config::Device*);
Fields<2> ListOf(config::Record*);
Fields<3> ListOf(config::Identity*);
Fields<22> ListOf(config::Point*);
Fields<8> ListOf(config::PointEvent*);
Fields<8> ListOf(config::Writing*);
Fields<6> ListOf(config::AllowWhen*);
Fields<2> ListOf(config::Sentinel*);
Fields<2> ListOf(config::OnFault*);
Fields<3> ListOf(config::Simulate*);
Fields<7> ListOf(config::EventText*);
Fields<3> ListOf(config::Mark*);
Fields<6> ListOf(config::Timing*);
Fields<8> ListOf(config::SerialSettings*);
Fields<5> ListOf(config::Rs485*);

Methods<&Conversation::Queries, &Conversation::HasEvents, &Conversation::BackgroundDue,
        &Conversation::OnEventsKept, &Conversation::Ask, &Conversation::WritesTogether,
        &Conversation::OnFrame, &Conversation::OnSent, &Conversation::Stamp,
        &Conversation::OnHostClock, &Conversation::OnFailure, &Conversation::Instead,
        &Conversation::Listens, &Conversation::OnUnasked, &Conversation::DueAt,
        &Conversation::OnDue, &Conversation::OnReconnect, &Conversation::OnEnabled,
        &Conversation::trouble, &Conversation::Memory, &Conversation::Recall,
        &Conversation::ForgetRefusals, &Conversation::Check, &Conversation::Interpret,
        &Conversation::LeastTimes, &Conversation::WhatIsLearned>
ListOf(Conversation*);
Methods<&TwinValues::Get, &TwinValues::Set> ListOf(TwinValues*);
Methods<&Twin::Answer, &Twin::ReplyAs, &Twin::SetClock, &Twin::Raise, &Twin::Say> ListOf(Twin*);
Methods<> ListOf(Bus*);

Types<config::OptionValue> ListOf(config::Options*);
Leaf ListOf(Status*);
Leaf ListOf(Duration*);
Leaf ListOf(Instant*);
Leaf ListOf(WallTime*);
Leaf ListOf(Now*);
Leaf ListOf(std::monostate*);
template <template <typename...> class Template, typename... T>
Types<T...> ListOf(Template<T...>*);
template <typename T, std::size_t kExtent>
Types<T> ListOf(std::span<T, kExtent>*);
template <typename T, std::size_t kCount>
Types<T> ListOf(std::array<T, kCount>*);
void ListOf(void*);  // anything else

// clang-format off: one line for each number of fields
template <typename T>
auto Split(T& s, Fields<2>) {
  auto& [a, b] = s;
  return Types<decltype(a), decltype(b)>();
}
template <typename T>
auto Split(T& s, Fields<3>) {
  auto& [a, b, c] = s;
  return Types<decltype(a), decltype(b), decltype(c)>();
}
template <typename T>
auto Split(T& s, Fields<4>) {
  auto& [a, b, c, d] = s;
  return Types<decltype(a), decltype(b), decltype(c), decltype(d)>();
}
template <typename T>
auto Split(T& s, Fields<5>) {
  auto& [a, b, c, d, e] = s;
  return Types<decltype(a), decltype(b), decltype(c), decltype(d), decltype(e)>();
}
template <typename T>
auto Split(T& s, Fields<6>) {
  auto& [a, b, c, d, e, f] = s;
  return Types<decltype(a), decltype(b), decltype(c), decltype(d), decltype(e), decltype(f)>();
}
template <typename T>
auto Split(T& s, Fields<7>) {
  auto& [a, b, c, d, e, f, g] = s;
  return Types<decltype(a), decltype(b), decltype(c), decltype(d), decltype(e), decltype(f),
               decltype(g)>();
}
template <typename T>
auto Split(T& s, Fields<8>) {
  auto& [a, b, c, d, e, f, g, h] = s;
  return Types<decltype(a), decltype(b), decltype(c), decltype(d), decltype(e), decltype(f),
               decltype(g), decltype(h)>();
}
template <typename T>
auto Split(T& s, Fields<9>) {
  auto& [a, b, c, d, e, f, g, h, i] = s;
  return Types<decltype(a), decltype(b), decltype(c), decltype(d), decltype(e), decltype(f),
               decltype(g), decltype(h), decltype(i)>();
}
template <typename T>
auto Split(T& s, Fields<22>) {
  auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, t, u, v, w] = s;
  return Types<decltype(a), decltype(b), decltype(c), decltype(d), decltype(e), decltype(f),
               decltype(g), decltype(h), decltype(i), decltype(j), decltype(k), decltype(l),
               decltype(m), decltype(n), decltype(o), decltype(p), decltype(q), decltype(r),
               decltype(t), decltype(u), decltype(v), decltype(w)>();
}
template <typename T>
auto Split(T& s, Fields<23>) {
  auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, t, u, v, w, x] = s;
  return Types<decltype(a), decltype(b), decltype(c), decltype(d), decltype(e), decltype(f),
               decltype(g), decltype(h), decltype(i), decltype(j), decltype(k), decltype(l),
               decltype(m), decltype(n), decltype(o), decltype(p), decltype(q), decltype(r),
               decltype(t), decltype(u), decltype(v), decltype(w), decltype(x)>();
}
template <typename T>
auto Split(T& s, Fields<26>) {
  auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, t, u, v, w, x, y, z, s26] = s;
  return Types<decltype(a), decltype(b), decltype(c), decltype(d), decltype(e), decltype(f),
               decltype(g), decltype(h), decltype(i), decltype(j), decltype(k), decltype(l),
               decltype(m), decltype(n), decltype(o), decltype(p), decltype(q), decltype(r),
               decltype(t), decltype(u), decltype(v), decltype(w), decltype(x), decltype(y),
               decltype(z), decltype(s26)>();
}
// clang-format on

/// FNV-1a of 64 bits.
constexpr std::uint64_t Mix(std::uint64_t hash, std::string_view text) {
  for (const char c : text) hash = (hash ^ static_cast<std::uint8_t>(c)) * 0x100000001B3U;
  return hash;
}
constexpr std::uint64_t Mix(std::uint64_t hash, std::uint64_t number) {
  for (int i = 0; i < 8; ++i) hash = (hash ^ ((number >> (8 * i)) & 0xFFU)) * 0x100000001B3U;
  return hash;
}

/// What the compiler calls a type, or values of an enum: those with a name show it.
template <typename T>
constexpr std::string_view NameOf() {
  return __PRETTY_FUNCTION__;
}
template <auto... kValues>
constexpr std::string_view NamesOf() {
  return __PRETTY_FUNCTION__;
}

template <typename T>
constexpr std::uint64_t Hash();

template <typename... T>
constexpr std::uint64_t HashAll(Types<T...>) {
  std::uint64_t hash = 0;
  ((hash = Mix(hash, Hash<T>())), ...);
  return hash;
}

template <typename R, typename... T>
constexpr std::uint64_t HashSignature(R (*)(T...)) {
  return HashAll(Types<R, std::remove_cvref_t<T>...>());
}
template <typename R, typename C, typename... T>
constexpr std::uint64_t HashSignature(R (C::*)(T...)) {
  return HashAll(Types<R, std::remove_cvref_t<T>...>());
}
template <typename R, typename C, typename... T>
constexpr std::uint64_t HashSignature(R (C::*)(T...) const) {
  return Mix(HashAll(Types<R, std::remove_cvref_t<T>...>()), "const");
}

template <typename E, std::size_t... kIndices>
constexpr std::string_view EnumeratorsOf(std::index_sequence<kIndices...>) {
  return NamesOf<static_cast<E>(kIndices)...>();
}

template <typename T>
constexpr std::uint64_t HashListed(Leaf) {
  return sizeof(T);
}
template <typename T, typename... A>
constexpr std::uint64_t HashListed(Types<A...> arguments) {
  return Mix(HashAll(arguments), sizeof(T));
}
template <typename T, std::size_t kCount>
constexpr std::uint64_t HashListed(Fields<kCount> fields) {
  return Mix(HashAll(decltype(Split(std::declval<T&>(), fields))()), sizeof(T));
}
template <typename T, auto... kMethods>
constexpr std::uint64_t HashListed(Methods<kMethods...>) {
  std::uint64_t hash = 0;
  ((hash = Mix(Mix(hash, NamesOf<kMethods>()), HashSignature(kMethods))), ...);
  return hash;
}

template <typename T>
constexpr std::uint64_t Compute() {
  const std::uint64_t hash = Mix(0xCBF29CE484222325U, NameOf<T>());
  if constexpr (std::is_enum_v<T>) {
    static_assert(sizeof(T) == 1, "every value of an enum is listed: give it std::uint8_t");
    return Mix(hash, EnumeratorsOf<T>(std::make_index_sequence<256>()));
  } else if constexpr (std::is_pointer_v<T> && std::is_function_v<std::remove_pointer_t<T>>) {
    return Mix(hash, HashSignature(static_cast<T>(nullptr)));
  } else if constexpr (std::is_pointer_v<T>) {
    return Mix(hash, Hash<std::remove_pointer_t<T>>());
  } else if constexpr (std::is_class_v<T>) {
    using List = decltype(ListOf(static_cast<T*>(nullptr)));
    static_assert(!std::is_void_v<List>, "a type of the plugin contract is not listed here");
    return Mix(hash, HashListed<T>(List()));
  } else if constexpr (std::is_void_v<T>) {
    return hash;
  } else {
    return Mix(hash, sizeof(T));
  }
}

template <typename T>
inline constexpr std::uint64_t kHash = Compute<T>();

template <typename T>
constexpr std::uint64_t Hash() {
  return kHash<std::remove_cv_t<T>>;
}

#define BAUDGATE_STRING_(x) #x
#define BAUDGATE_STRING(x) BAUDGATE_STRING_(x)
/// Compiler and standard library ABI that a module must share with the daemon.
inline constexpr std::string_view kCompiler =
    "gcc" BAUDGATE_STRING(__GNUC__) "-cxxabi" BAUDGATE_STRING(__GXX_ABI_VERSION);
#undef BAUDGATE_STRING
#undef BAUDGATE_STRING_

/// "gcc12-cxxabi1017 contract 0123456789abcdef", and a 0 at its end.
constexpr auto MakeTag() {
  constexpr std::string_view kWord = " contract ";
  std::array<char, kCompiler.size() + kWord.size() + 17> tag{};
  std::size_t at = 0;
  for (const char c : kCompiler) tag[at++] = c;
  for (const char c : kWord) tag[at++] = c;
  for (int shift = 60; shift >= 0; shift -= 4) {
    tag[at++] = "0123456789abcdef"[(Hash<Protocol>() >> shift) & 0xFU];
  }
  return tag;
}
inline constexpr auto kTagText = MakeTag();
inline constexpr const char* kTag = kTagText.data();

}  // namespace baudgate::abi

/// What every module exports, generated by protocols/CMakeLists.txt. The tag is asked for first.
/// The daemon never unloads a module, so the descriptor lives for ever.
extern "C" const char* baudgate_protocol_abi();
extern "C" const baudgate::Protocol* baudgate_protocol();
