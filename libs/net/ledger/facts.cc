#include "ledger/facts.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "core/utf8.h"
#include "transport/decode.h"
#include "transport/type_layout.h"

namespace skein {
namespace {

#define SKEIN_FACT_NAME(type, Name, COMMITTED, SUBMITTED) #type,
constexpr std::array<const char*, kNumFactKinds> kNames = {SKEIN_FACT_KINDS(SKEIN_FACT_NAME)};
#undef SKEIN_FACT_NAME

template <size_t kKind>
bool DecodeKind(const void* data, size_t size, Fact* fact) {
  return DecodeMessage(data, size, &fact->emplace<kKind>());
}

template <size_t... kKinds>
bool DecodeAny(size_t kind, const void* data, size_t size, Fact* fact,
               std::index_sequence<kKinds...>) {
  return ((kind == kKinds && DecodeKind<kKinds>(data, size, fact)) || ...);
}

struct BlobLister {
  std::vector<std::string> operator()(const image_t& f) const { return {f.blob_id}; }
  std::vector<std::string> operator()(const features_t& f) const {
    return {f.keypoints_blob, f.descriptors_blob, f.global_blob};
  }
  std::vector<std::string> operator()(const matches_t& f) const { return {f.pairs_blob}; }
  std::vector<std::string> operator()(const submap_model_t& f) const { return {f.model_blob}; }
  std::vector<std::string> operator()(const merge_t& f) const { return {f.model_blob}; }
  template <class T>
  std::vector<std::string> operator()(const T&) const {
    return {};
  }
};

}  // namespace

const char* FactKindName(int kind) {
  if (kind < 0 || kind >= kNumFactKinds) throw std::out_of_range("no such kind of fact");
  return kNames[kind];
}

int FactKindFromName(const std::string& name) {
  for (int kind = 0; kind < kNumFactKinds; ++kind) {
    if (name == kNames[kind]) return kind;
  }
  return -1;
}

Bytes EncodeFact(const Fact& fact) {
  return std::visit(
      [](const auto& f) {
        Bytes bytes(f.getEncodedSize());
        f.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
        return bytes;
      },
      fact);
}

Result<Fact> DecodeFact(int kind, const void* data, size_t size) {
  Fact fact;
  if (kind < 0 || !DecodeAny(kind, data, size, &fact, std::make_index_sequence<kNumFactKinds>())) {
    return DataLoss("not a fact of kind " + std::to_string(kind) + ", or damaged");
  }
  return fact;
}

std::vector<std::string> BlobsOf(const Fact& fact) {
  std::vector<std::string> blobs;
  for (std::string& blob : std::visit(BlobLister(), fact)) {
    if (!blob.empty()) blobs.push_back(std::move(blob));
  }
  return blobs;
}

bool HasValidTexts(const Fact& fact) {
  const Bytes bytes = EncodeFact(fact);
  const std::string type = std::visit([](const auto& f) { return f.getTypeName(); }, fact);
  return TypeLayout::Of(type).HasValidTexts(bytes.data() + kFingerprintBytes,
                                            bytes.size() - kFingerprintBytes);
}

std::string ClampText(const std::string& text, size_t max_bytes) {
  std::string clamped;
  for (size_t at = 0; at < text.size();) {
    const size_t length = Utf8Length(text, at);
    if (clamped.size() + std::max<size_t>(1, length) > max_bytes) break;
    clamped += length == 0 ? "?" : text.substr(at, length);
    at += std::max<size_t>(1, length);
  }
  return clamped;
}

}  // namespace skein
