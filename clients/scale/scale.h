#pragma once

namespace skein {

// `skein scale`: workers of a session come and go with its backlog, by Slurm or on this host.
int RunScale(int argc, char** argv);

}  // namespace skein
