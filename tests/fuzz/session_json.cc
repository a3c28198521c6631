// A file as session.json.
#include "fuzz/fuzz.h"
#include "ledger/session_folder.h"

namespace skein::fuzz {

SKEIN_FUZZ_TARGET(session_json) {
  static const ScratchFolder folder;
  folder.Write("session.json", data, size);
  const auto session = OpenSession(folder.path());
  if (!session.ok()) return;
  Expect(session->session_id.size() == 16, "an id has 16 digits");
  if (!ClaimSession(*session).ok()) return;
  Expect(OpenSession(folder.path())->session_id == session->session_id, "a session keeps its id");
}

}  // namespace skein::fuzz
