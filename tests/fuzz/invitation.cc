// Links of invitations.
#include "transport/invitation.h"

#include "fuzz/fuzz.h"

namespace skein::fuzz {

SKEIN_FUZZ_TARGET(invitation) {
  const std::string link = ToText(data, size);
  if (!link.empty() && link[0] == '@') return;  // names a file
  const auto invitation = ReadInvitation(link);
  if (!invitation.ok()) return;
  const auto again = ReadInvitation(ToLink(*invitation));
  Expect(again.ok(), "an invitation that was read can be passed on");
  Expect(again->url.ToString() == invitation->url.ToString() &&
             again->trust.session_id == invitation->trust.session_id,
         "and leads to the same session");
}

}  // namespace skein::fuzz
