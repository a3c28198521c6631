#pragma once

#include <string>

#include "core/result.h"
#include "web/web_server.h"

namespace CLI {
class App;
}

namespace skein {

struct WebOptions {
  WebServerOptions server;
  std::string page_dir;  // "": ../web beside the program

  Status Check() const { return server.Check(); }
};

// [web] of a config file.
void AddOptions(CLI::App& app, WebOptions* options);

}  // namespace skein
