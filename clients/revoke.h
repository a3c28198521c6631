// `skein revoke`: takes an invitation back.
#pragma once

namespace skein {

int RunRevoke(int argc, char** argv);

}  // namespace skein
