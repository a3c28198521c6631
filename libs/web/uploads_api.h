// /api/uploads: photos that browsers send, and what became of them.
#pragma once

#include <memory>

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
  void GetStates(const HttpRequest& request, const Respond& respond) const;

  const SessionView& view_;
  const SessionSource& source_;
};

}  // namespace skein
