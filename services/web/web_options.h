#pragma once

#include <string>

#include "core/result.h"
#include "http/web_server.h"
#include "web/upload_store.h"

namespace CLI {
class App;
}

namespace skein {

struct WebOptions {
  WebServerOptions server;
  std::string page_dir;  // "": ../web beside the program

  // For visitors from elsewhere, with a pass.
  std::string public_host;  // "": nobody
  int public_port = 8471;   // TLS
  int plain_port = 0;       // in the clear; 0: none
  UploadLimits uploads;

  bool is_public() const { return !public_host.empty(); }
  Status Check() const;
};

// [web] of a config file.
void AddOptions(CLI::App& app, WebOptions* options);

}  // namespace skein
