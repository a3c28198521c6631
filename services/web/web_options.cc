#include "web/web_options.h"

#include <CLI/CLI.hpp>

namespace skein {

void AddOptions(CLI::App& app, WebOptions* options) {
  app.add_option("--address", options->server.address,
                 "IP address to listen on; others than 127.0.0.1 show the session to the network");
  app.add_option("--port", options->server.port, "TCP port; 0: a free one");
  app.add_option("--page", options->page_dir,
                 "Folder of the page; \"\": ../web beside this program");
}

}  // namespace skein
