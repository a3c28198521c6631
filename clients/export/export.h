// `skein export`: models, features and matches in the formats of other programs.
#pragma once

namespace skein {

int RunExport(int argc, char** argv);

}  // namespace skein
