#pragma once

namespace skein {

// `skein finish`: asks ingest to finish the session, and waits for its models.
int RunFinish(int argc, char** argv);

}  // namespace skein
