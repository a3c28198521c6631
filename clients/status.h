#pragma once

namespace skein {

// `skein status`: what a session's services do and what became of its photos, live.
int RunStatus(int argc, char** argv);

}  // namespace skein
