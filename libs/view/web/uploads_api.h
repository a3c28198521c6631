// /api/uploads: photos that browsers send, and what became of them.
#pragma once

#include <memory>
#include <string>

#include "web/api_answers.h"
#include "web/http.h"
#include "web/session_source.h"
#include "web/session_view.h"

namespace skein {

// Any thread.
class UploadsApi {
 public:
  // Both outlive this.
  UploadsApi(const SessionView& view, const SessionSource& source);

  // `parts`: {"uploads", SHA256}. Null: nothing is uploaded here.
  std::shared_ptr<BodySink> MakeSink(const PathParts& parts, const HttpRequest& request);
  // `parts`: {"uploads", SHA256 or "states"}.
  void Handle(const PathParts& parts, const HttpRequest& request, Respond respond);

 private:
  bool HasReadLedger() const { return !source_.has_read_ledger || source_.has_read_ledger(); }
  void Head(const std::string& agent, const std::string& blob_id, const Respond& respond) const;
  void GetStates(const HttpRequest& request, const Respond& respond) const;

  const SessionView& view_;
  const SessionSource& source_;
};

}  // namespace skein
