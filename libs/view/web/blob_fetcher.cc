#include "web/blob_fetcher.h"

#include <memory>
#include <mutex>
#include <set>
#include <utility>

#include "web/api_answers.h"

namespace skein {

void BlobFetcher::Fetch(const std::string& blob_id, const std::string& owner,
                        SessionSource::Done done) {
  pool_.Run([this, blob_id, owner, done = std::move(done)] { fetch_(blob_id, owner, done); });
}

void BlobFetcher::FetchAll(const std::vector<std::string>& blob_ids, const std::string& owner,
                           const Respond& respond, std::function<void(Blobs)> then) {
  struct Gathered {
    std::mutex mutex;
    Blobs blobs;
    size_t num_left = 0;
    bool failed = false;
  };
  const std::set<std::string> wanted(blob_ids.begin(), blob_ids.end());
  const auto gathered = std::make_shared<Gathered>();
  gathered->num_left = wanted.size();
  for (const std::string& id : wanted) {
    Fetch(id, owner, [this, gathered, id, respond, then](Result<Bytes> bytes) {
      const std::lock_guard<std::mutex> lock(gathered->mutex);
      if (gathered->failed) return;
      if (!bytes.ok()) {
        gathered->failed = true;
        return AnswerError(respond, bytes.status());
      }
      gathered->blobs[id] = std::move(*bytes);
      if (--gathered->num_left > 0) return;
      pool_.Run([gathered, then] { then(std::move(gathered->blobs)); });
    });
  }
}

}  // namespace skein
