// A photo's bytes from a PATCH into the upload store. services/web/README.md has the protocol.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "http/http.h"
#include "http/job_pool.h"
#include "web/upload_store.h"

namespace skein {

// Sink for a request to /api/uploads/SHA256. `store` and `pool` outlive it; the pool writes.
std::shared_ptr<BodySink> MakeUploadSink(UploadStore& store, JobPool& pool,
                                         const HttpRequest& request, const std::string& blob_id);

// HEAD of it: how much of the photo is here. `is_in_ledger`: all of it, and ingest has it.
HttpResponse UploadHead(const std::optional<UploadStore::Progress>& here, bool is_in_ledger);

}  // namespace skein
