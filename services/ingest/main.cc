#include <cstdio>

#include "core/version.h"
#include "ingest/ingest_options.h"
#include "ingest/ingest_service.h"
#include "ledger/session_folder.h"
#include "node/service_options.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "ingest";
  node_options.signer.role = skein::Role::kIngest;
  node_options.cache_bytes = 64 << 20;
  skein::IngestOptions options;
  skein::Program program = skein::IngestProgram(&node_options, &options);
  program.version = skein::VersionWithCommit();
  if (const auto code =
          skein::ParseProgramOptions(program, argc, argv, &node_options.configuration)) {
    return *code;
  }
  if (node_options.session_dir.empty()) {
    std::fprintf(stderr, "skein-ingest: it keeps the session folder: give --session DIR\n");
    return 2;
  }
  const auto session = skein::OpenOrCreateSession(node_options.session_dir);
  const skein::Status claimed = session.ok() ? skein::ClaimSession(*session) : session.status();
  if (!claimed.ok()) {
    std::fprintf(stderr, "skein-ingest: %s\n", claimed.error().c_str());
    // 2: a start that is tried again would not help.
    return claimed.code == skein::StatusCode::kFailedPrecondition ? 2 : 1;
  }
  return skein::RunService(node_options, [&](skein::Node& node) {
    skein::IngestService service(node, options);
    node.Run();
  });
}
