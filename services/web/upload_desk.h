// Offers the photos that phones have uploaded to ingest, in the names of their agents.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>

#include "event_loop/alive.h"
#include "node/node.h"
#include "node/publisher.h"
#include "web/upload_store.h"

namespace skein {

// A photo stays in the store until ingest has decided it: what a crash interrupts is offered again
// at the next start. Loop's thread only.
class UploadDesk {
 public:
  // `store` outlives it.
  UploadDesk(Node& node, UploadStore& store);
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
  void OfferNew();
  void OnPublished(const std::string& agent, const PublishedPhoto& photo);

  Node& node_;
  UploadStore& store_;
  std::map<std::string, Agent> agents_;  // that have photos under way
  double rest_until_s_ = 0;              // where a photo could not be read
  PollLoop::TimerId timer_ = 0;
  Alive alive_;
};

}  // namespace skein
