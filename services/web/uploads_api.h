// /api/uploads: photos that browsers send, and what became of them.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "http/http.h"
#include "http/job_pool.h"
#include "session/troubles.h"
#include "skein/advice_t.hpp"
#include "web/session_view.h"
#include "web/upload_store.h"

namespace skein {

// News that a phone is told beside the states of its photos. Called on threads of the job pool.
struct UploadNews {
  // Whether the view has been given all that the ledger holds: until then it cannot tell that a
  // photo is unknown. Null: it has.
  std::function<bool()> has_read_ledger;
  // Latest advice of the guide to an agent, in a submap that lives. Null: no guide is known.
  std::function<std::optional<advice_t>(const std::string& agent)> advice;
  // Troubles that a person has to mend. Null: they are not known.
  std::function<std::vector<Trouble>()> troubles;
};

// Any thread.
class UploadsApi {
 public:
  // `view`, `store` and `jobs` outlive the requests. The jobs end before this does.
  UploadsApi(const SessionView& view, UploadStore& store, JobPool& jobs, UploadNews news);

  // For a WebServer. Null: the path is none of /api/uploads/SHA256.
  std::shared_ptr<BodySink> MakeSink(const HttpRequest& request);
  // A request to /api/uploads/NAME. `name`: a SHA256, or "states".
  void Handle(const std::string& name, const HttpRequest& request, Respond respond);

 private:
  bool HasReadLedger() const { return !news_.has_read_ledger || news_.has_read_ledger(); }
  void Head(const std::string& agent, const std::string& blob_id, const Respond& respond) const;
  void GetStates(const HttpRequest& request, const Respond& respond) const;

  const SessionView& view_;
  UploadStore& store_;
  JobPool& jobs_;
  const UploadNews news_;
};

}  // namespace skein
