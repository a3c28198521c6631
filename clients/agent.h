#pragma once

namespace skein {

// `skein agent`: publishes the photos of a folder to a session.
int RunAgent(int argc, char** argv);

}  // namespace skein
