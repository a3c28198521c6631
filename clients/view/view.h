// `skein view`: a session folder in a browser, without services.
#pragma once

namespace skein {

int RunView(int argc, char** argv);

}  // namespace skein
