// /download: the newest models as files. The server makes one download at a time; a request
// meanwhile is answered with 503. A file that is still being sent is sent to others, too, and there
// are kMostFiles of them at most: who takes files slowly fills no disk.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <string>

#include "http/http.h"
#include "web/api_answers.h"
#include "web/blob_fetcher.h"
#include "web/session_view.h"

namespace skein {

class TemporaryFolder;

// Any thread.
class Downloads {
 public:
  // Both outlive this, and answers to Handle.
  Downloads(const SessionView& view, BlobFetcher& blobs);

  // `parts`: {"model.zip"}. The query "georeferenced" moves the models into metres east, north and
  // up by their photos' GPS, as `skein export --georeferenced`; 404 with the reason if none can be.
  void Handle(const PathParts& parts, const HttpRequest& request, Respond respond);

 private:
  using FolderPtr = std::shared_ptr<const TemporaryFolder>;

  static HttpResponse Answer(const std::string& name, FolderPtr folder);
  // A file that is still being sent; nullptr if none has that content.
  FolderPtr Find(const std::string& content);

  const SessionView& view_;
  BlobFetcher& blobs_;
  std::atomic<bool> is_making_{false};
  // By format and blobs. Only who has set is_making_ reads and writes it.
  std::map<std::string, std::weak_ptr<const TemporaryFolder>> sent_;
};

}  // namespace skein
