#pragma once

namespace skein {

// `skein config`: every service's options with their defaults, as a config file.
int RunConfig(int argc, char** argv);

}  // namespace skein
