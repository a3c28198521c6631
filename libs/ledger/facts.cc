#include "ledger/facts.h"

#include <array>
#include <stdexcept>
#include <utility>

#include "transport/decode.h"

namespace skein {
namespace {

constexpr std::array<const char*, kNumFactKinds> kNames = {
    "image",        "features",   "candidates", "matches", "seed",   "submap_lease", "registration",
    "submap_model", "submap_end", "merge",      "failure", "finish", "configuration"};

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

std::string ClampText(const std::string& text, size_t max_bytes) {
  if (text.size() <= max_bytes) return text;
  size_t end = max_bytes;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return text.substr(0, end);
}

}  // namespace skein
