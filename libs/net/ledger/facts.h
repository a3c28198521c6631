// A fact of any kind, and what holds for all kinds.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"
#include "skein/fact_header_t.hpp"
#include "transport/channels.h"

namespace skein {

namespace facts_internal {
template <class Nothing, class... T>
struct VariantOf {
  using Type = std::variant<T...>;
};
}  // namespace facts_internal

// image_t, features_t, ..., configuration_t: the kinds of SKEIN_FACT_KINDS in their order.
#define SKEIN_FACT_TYPE(type, Name, COMMITTED, SUBMITTED) , type##_t
using Fact = facts_internal::VariantOf<void SKEIN_FACT_KINDS(SKEIN_FACT_TYPE)>::Type;
#undef SKEIN_FACT_TYPE

inline constexpr int kNumFactKinds = static_cast<int>(std::variant_size_v<Fact>);

// Kind: 0..kNumFactKinds-1, its index in Fact. Names: "image", "features", ..., "configuration".
inline int FactKind(const Fact& fact) { return static_cast<int>(fact.index()); }
const char* FactKindName(int kind);
inline const char* FactKindName(const Fact& fact) { return FactKindName(FactKind(fact)); }
// -1 if there is no such kind.
int FactKindFromName(const std::string& name);

inline const fact_header_t& Header(const Fact& fact) {
  return std::visit([](const auto& f) -> const fact_header_t& { return f.header; }, fact);
}
inline fact_header_t& Header(Fact& fact) {
  return std::visit([](auto& f) -> fact_header_t& { return f.header; }, fact);
}

// As LCM encodes the type, fingerprint first.
Bytes EncodeFact(const Fact& fact);
// An error if the bytes are not exactly one fact of that kind.
Result<Fact> DecodeFact(int kind, const void* data, size_t size);

// Names of the fact's blobs, none empty. The author serves them until the fact is committed.
std::vector<std::string> BlobsOf(const Fact& fact);

// Whether all of its strings are valid UTF-8.
bool HasValidTexts(const Fact& fact);

// At most max_bytes of the text, cut between UTF-8 characters, for reasons that go into messages.
// Invalid UTF-8 in the text becomes '?'.
std::string ClampText(const std::string& text, size_t max_bytes = 200);

// Channels of T as a fact and as a submission.
template <class T>
struct FactChannels;
#define SKEIN_FACT_CHANNELS(type, Name, COMMITTED, SUBMITTED)              \
  template <>                                                              \
  struct FactChannels<type##_t> {                                          \
    static constexpr Channel<type##_t> committed = k##Name##Channel;       \
    static constexpr Channel<type##_t> submitted = kSubmit##Name##Channel; \
  };
SKEIN_FACT_KINDS(SKEIN_FACT_CHANNELS)
#undef SKEIN_FACT_CHANNELS

namespace facts_internal {
template <class Fn, class... T>
void VisitCommitted(Fn& fn, const std::variant<T...>*) {
  (fn(FactChannels<T>::committed), ...);
}
template <class Fn, class... T>
void VisitSubmitted(Fn& fn, const std::variant<T...>*) {
  (fn(FactChannels<T>::submitted), ...);
}
}  // namespace facts_internal

// Calls fn(Channel<T>) with the channel of every kind: committed facts, or submissions.
template <class Fn>
void ForEachCommittedChannel(Fn fn) {
  facts_internal::VisitCommitted(fn, static_cast<const Fact*>(nullptr));
}
template <class Fn>
void ForEachSubmitChannel(Fn fn) {
  facts_internal::VisitSubmitted(fn, static_cast<const Fact*>(nullptr));
}

}  // namespace skein
