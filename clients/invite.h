#pragma once

namespace skein {

// `skein invite`: a credential of the session, as a link and a QR code.
int RunInvite(int argc, char** argv);

}  // namespace skein
