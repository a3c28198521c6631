// A file as session.json.
#include "fuzz/fuzz.h"
#include "ledger/session_folder.h"

using namespace skein;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const fuzz::ScratchFolder folder;
  folder.Write("session.json", data, size);
  const auto session = OpenSession(folder.path());
  if (!session.ok()) return 0;
  fuzz::Expect(session->session_id.size() == 16, "an id has 16 digits");
  if (!ClaimSession(*session).ok()) return 0;
  fuzz::Expect(OpenSession(folder.path())->session_id == session->session_id,
               "a session keeps its id");
  return 0;
}
