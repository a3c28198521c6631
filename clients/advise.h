#pragma once

namespace skein {

// `skein advise`: how complete each place is, and what each agent can photograph next, live.
int RunAdvise(int argc, char** argv);

}  // namespace skein
