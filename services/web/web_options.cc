#include "web/web_options.h"

#include <CLI/CLI.hpp>

#include "core/option_check.h"

namespace skein {

void AddOptions(CLI::App& app, WebOptions* options) {
  app.add_option("--address", options->server.address,
                 "IP address to listen on; others than 127.0.0.1 show the session to the network");
  app.add_option("--port", options->server.port, "TCP port; 0: a free one");
  app.add_option("--page", options->page_dir,
                 "Folder of the page; \"\": ../web beside this program");
  app.add_option("--public-host", options->public_host,
                 "Let browsers of other hosts in, with invitations: this host's address or name, "
                 "as they reach it");
  app.add_option("--public-port", options->public_port, "Of these, over TLS")
      ->capture_default_str();
  app.add_option("--plain-port", options->plain_port,
                 "Of these, without encryption, for a network that is yours alone; 0: none")
      ->capture_default_str();
  app.add_option("--max-photo-bytes", options->uploads.max_photo_bytes,
                 "Of an uploaded photo; larger ones are refused")
      ->capture_default_str();
  app.add_option("--max-upload-bytes", options->uploads.max_bytes,
                 "Of all uploads that ingest does not have yet")
      ->capture_default_str();
  app.add_option("--min-free", options->uploads.min_free_bytes,
                 "Free bytes on the disk for an upload to be taken")
      ->capture_default_str();
}

Status WebOptions::Check() const {
  const auto positive = [](const char* name, int64_t value) {
    return value > 0 ? Status::Ok()
                     : InvalidArgument("--" + std::string(name) + ": give a number above 0");
  };
  const Status status = FirstError({server.Check(), InRange("public_port", public_port, 0, 65535),
                                    InRange("plain_port", plain_port, 0, 65535),
                                    positive("max-photo-bytes", uploads.max_photo_bytes),
                                    positive("max-upload-bytes", uploads.max_bytes)});
  if (!status.ok()) return status;
  if (plain_port != 0 && !is_public()) {
    return InvalidArgument("--plain-port is for visitors of other hosts: give --public-host, too");
  }
  return Status::Ok();
}

}  // namespace skein
