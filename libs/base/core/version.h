#pragma once

namespace skein {

// "0.1.0", as CMakeLists.txt says.
const char* Version();

// With the commit that the program was built from, as `git describe` names it: "0.1.0
// (f571a2cb0d)". "0.1.0" where the source was in no git repository. The library skein_commit
// defines it. Programs link that library, other libraries do not: after a commit no test is linked
// again.
const char* VersionWithCommit();

}  // namespace skein
