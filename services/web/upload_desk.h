// Offers the photos that phones have uploaded to ingest, in the names of their agents.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "event_loop/alive.h"
#include "node/node.h"
#include "node/publisher.h"
#include "web/upload_store.h"

namespace skein {

// A photo stays in the store until ingest has decided it: what a crash interrupts is offered again
// at the next start. A photo that ingest has stays until the ledger's reader here knows of it, too:
// a phone that asks between the two would be told that the photo is unknown, and send it again.
// Loop's thread only.
class UploadDesk {
 public:
  // Whether the ledger, as it is known here, has a photo of these bytes.
  using IsInLedger = std::function<bool(const std::string& blob_id)>;

  // `store` outlives it.
  UploadDesk(Node& node, UploadStore& store, IsInLedger is_in_ledger);
  ~UploadDesk();
  UploadDesk(const UploadDesk&) = delete;
  UploadDesk& operator=(const UploadDesk&) = delete;

  int num_offered() const;

 private:
  struct Agent {
    std::set<std::string> offered;  // blobs
    std::unique_ptr<Publisher> publisher;
  };

  void Look();
  void RemoveKnown();
  void OfferNew();
  void OnPublished(const std::string& agent, const PublishedPhoto& photo);

  Node& node_;
  UploadStore& store_;
  const IsInLedger is_in_ledger_;
  std::map<std::string, Agent> agents_;                         // that have photos under way
  std::set<std::pair<std::string, std::string>> acknowledged_;  // agent, blob; not known yet
  double rest_until_s_ = 0;                                     // where a photo could not be read
  PollLoop::TimerId timer_ = 0;
  Alive alive_;
};

}  // namespace skein
