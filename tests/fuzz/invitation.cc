// Links of invitations.
#include "transport/invitation.h"

#include "fuzz/fuzz.h"

using namespace skein;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string link = fuzz::ToText(data, size);
  if (!link.empty() && link[0] == '@') return 0;  // names a file
  const auto invitation = ReadInvitation(link);
  if (!invitation.ok()) return 0;
  const auto again = ReadInvitation(ToLink(*invitation));
  fuzz::Expect(again.ok(), "an invitation that was read can be passed on");
  fuzz::Expect(again->url.ToString() == invitation->url.ToString() &&
                   again->trust.session_id == invitation->trust.session_id,
               "and leads to the same session");
  return 0;
}
