// Blobs for answers.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/bytes.h"
#include "http/http.h"
#include "http/job_pool.h"
#include "web/session_source.h"

namespace skein {

// Any thread.
class BlobFetcher {
 public:
  using Blobs = std::map<std::string, Bytes>;

  // `pool` is used until the last fetch has ended.
  BlobFetcher(SessionSource::Fetch fetch, JobPool& pool) : fetch_(std::move(fetch)), pool_(pool) {}

  // Never on the calling thread, so it may block.
  void Fetch(const std::string& blob_id, const std::string& owner, SessionSource::Done done);
  // Calls `then` with all of these blobs on a thread of the pool, or answers with what is wrong.
  void FetchAll(const std::vector<std::string>& blob_ids, const std::string& owner,
                const Respond& respond, std::function<void(Blobs)> then);

 private:
  const SessionSource::Fetch fetch_;
  JobPool& pool_;
};

}  // namespace skein
