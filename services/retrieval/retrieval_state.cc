#include "retrieval/retrieval_state.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "core/clock.h"
#include "core/hash.h"

namespace skein {
namespace {

constexpr char kMagic[4] = {'S', 'K', 'H', 'N'};
constexpr uint32_t kVersion = 2;

void PutCandidates(const Candidates& candidates, ByteWriter* writer) {
  writer->Put(candidates.image_id);
  writer->Put(candidates.insert_s);
  writer->Put(candidates.query_s);
  writer->Put(static_cast<uint32_t>(candidates.neighbours.size()));
  for (const Neighbour& n : candidates.neighbours) {
    writer->Put(n.id);
    writer->Put(n.distance);
  }
}

bool GetCandidates(ByteReader* reader, Candidates* candidates) {
  uint32_t count = 0;
  if (!reader->Get(&candidates->image_id) || !reader->Get(&candidates->insert_s) ||
      !reader->Get(&candidates->query_s) || !reader->Get(&count)) {
    return false;
  }
  for (uint32_t i = 0; i < count; ++i) {
    Neighbour n;
    if (!reader->Get(&n.id) || !reader->Get(&n.distance)) return false;
    candidates->neighbours.push_back(n);
  }
  return true;
}

void PutSubmaps(int64_t image_id, const std::set<int64_t>& submaps, ByteWriter* writer) {
  writer->Put(image_id);
  writer->Put(static_cast<uint32_t>(submaps.size()));
  for (const int64_t submap_id : submaps) writer->Put(submap_id);
}

bool GetSubmaps(ByteReader* reader, int64_t* image_id, std::set<int64_t>* submaps) {
  uint32_t count = 0;
  if (!reader->Get(image_id) || !reader->Get(&count)) return false;
  for (uint32_t i = 0; i < count; ++i) {
    int64_t submap_id = 0;
    if (!reader->Get(&submap_id)) return false;
    submaps->insert(submap_id);
  }
  return true;
}

// Identifier, version and checksum.
Status CheckFrame(const Bytes& bytes) {
  if (bytes.size() < sizeof(kMagic) + sizeof(kVersion) + kHashSize ||
      std::memcmp(bytes.data(), kMagic, sizeof(kMagic)) != 0) {
    return DataLoss("not a retrieval checkpoint");
  }
  uint32_t version = 0;
  std::memcpy(&version, bytes.data() + sizeof(kMagic), sizeof(version));
  if (version != kVersion) {
    return DataLoss("checkpoint of version " + std::to_string(version) + ", this program reads " +
                    std::to_string(kVersion));
  }
  const size_t size = bytes.size() - kHashSize;
  const std::string checksum(bytes.begin() + static_cast<std::ptrdiff_t>(size), bytes.end());
  if (HashBytes(bytes.data(), size) != checksum) return DataLoss("checkpoint is damaged");
  return Status::Ok();
}

}  // namespace

Result<Candidates> RetrievalState::Add(int64_t image_id, const GlobalDescriptor& descriptor) {
  Candidates candidates;
  candidates.image_id = image_id;
  const auto& values = descriptor.values;
  if (values.empty()) return candidates;
  if (!std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); })) {
    return InvalidArgument("a value of the global descriptor is not finite");
  }
  const auto key = std::make_pair(descriptor.model, values.size());
  auto index = indices_.find(key);
  if (index == indices_.end()) {
    index = indices_.emplace(key, HnswIndex(values.size(), options_.hnsw)).first;
  }
  if (index->second.Contains(image_id)) return candidates;
  Timer timer;
  const auto search = index->second.Find(values.data());
  candidates.neighbours =
      index->second.NearestExpanded(search, options_.top_n, options_.num_expanding);
  candidates.query_s = static_cast<float>(timer.ElapsedS());
  timer.Restart();
  index->second.Insert(image_id, search);
  candidates.insert_s = static_cast<float>(timer.ElapsedS());
  return candidates;
}

void RetrievalState::NoteRegistered(int64_t image_id, int64_t submap_id) {
  auto& submaps = registered_in_[image_id];
  submaps.insert(submap_id);
  for (auto& [model, index] : indices_) index.Restore(image_id);
}

void RetrievalState::NoteWithdrawn(int64_t image_id, int64_t submap_id) {
  auto& submaps = registered_in_[image_id];
  submaps.erase(submap_id);
  if (!submaps.empty()) return;
  for (auto& [model, index] : indices_) index.Remove(image_id);
}

void RetrievalState::NoteFailed(int64_t image_id) {
  for (auto& [model, index] : indices_) index.Remove(image_id);
}

size_t RetrievalState::size() const {
  size_t sum = 0;
  for (const auto& [model, index] : indices_) sum += index.size();
  return sum;
}

Bytes RetrievalState::Encode(const std::string& session_id) const {
  ByteWriter writer;
  writer.PutRaw(kMagic, sizeof(kMagic));
  writer.Put(kVersion);
  writer.PutString(session_id);
  writer.Put(seq_);
  writer.Put(static_cast<uint32_t>(indices_.size()));
  for (const auto& [key, index] : indices_) {
    writer.PutString(key.first);
    writer.Put(static_cast<uint32_t>(index.dim()));
    writer.PutBytes(index.Encode());
  }
  writer.Put(static_cast<uint32_t>(registered_in_.size()));
  for (const auto& [image_id, submaps] : registered_in_) PutSubmaps(image_id, submaps, &writer);
  writer.Put(static_cast<uint32_t>(unanswered_.size()));
  for (const auto& [image_id, candidates] : unanswered_) PutCandidates(candidates, &writer);
  const std::string checksum = HashBytes(writer.bytes().data(), writer.size());
  writer.PutRaw(checksum.data(), checksum.size());
  return writer.Take();
}

struct RetrievalState::Reader {
  ByteReader bytes;
  RetrievalState* state;

  Status ReadIndices() {
    uint32_t count = 0;
    if (!bytes.Get(&count)) return Truncated();
    for (uint32_t i = 0; i < count; ++i) {
      std::string model;
      uint32_t dim = 0;
      Bytes graph;
      if (!bytes.GetString(&model) || !bytes.Get(&dim) || !bytes.GetBytes(&graph)) {
        return Truncated();
      }
      auto index = HnswIndex::Decode(graph, dim, state->options_.hnsw);
      if (!index) return index.status();
      state->indices_.emplace(std::make_pair(model, size_t{dim}), std::move(*index));
    }
    return Status::Ok();
  }

  Status ReadRegistered() {
    uint32_t count = 0;
    if (!bytes.Get(&count)) return Truncated();
    for (uint32_t i = 0; i < count; ++i) {
      int64_t image_id = 0;
      std::set<int64_t> submaps;
      if (!GetSubmaps(&bytes, &image_id, &submaps)) return Truncated();
      state->registered_in_.emplace(image_id, std::move(submaps));
    }
    return Status::Ok();
  }

  Status ReadUnanswered() {
    uint32_t count = 0;
    if (!bytes.Get(&count)) return Truncated();
    for (uint32_t i = 0; i < count; ++i) {
      Candidates candidates;
      if (!GetCandidates(&bytes, &candidates)) return Truncated();
      state->unanswered_.emplace(candidates.image_id, std::move(candidates));
    }
    return bytes.remaining() == 0 ? Status::Ok() : Truncated();
  }

  static Status Truncated() { return DataLoss("checkpoint's contents do not fit its size"); }
};

Result<RetrievalState> RetrievalState::Decode(const Bytes& bytes, const std::string& session_id,
                                              const RetrievalOptions& options) {
  Status status = CheckFrame(bytes);
  if (!status.ok()) return status;
  RetrievalState state(options);
  const size_t frame = sizeof(kMagic) + sizeof(kVersion);
  Reader reader{ByteReader(bytes.data() + frame, bytes.size() - frame - kHashSize), &state};
  std::string session;
  if (!reader.bytes.GetString(&session) || !reader.bytes.Get(&state.seq_)) {
    return Reader::Truncated();
  }
  if (session != session_id) return FailedPrecondition("checkpoint of another session, " + session);
  for (const auto read : {&Reader::ReadIndices, &Reader::ReadRegistered, &Reader::ReadUnanswered}) {
    status = (reader.*read)();
    if (!status.ok()) return status;
  }
  return state;
}

}  // namespace skein
