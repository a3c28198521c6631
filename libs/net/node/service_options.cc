#include "node/service_options.h"

#include <CLI/CLI.hpp>

namespace skein {

void AddPlaceOptions(CLI::App& app, NodeOptions* options) {
  app.add_option("--invite", options->invite,
                 "Elsewhere: the link that `skein invite` printed there, or @FILE with it");
  app.add_option("--session-id", options->session_id,
                 "The session's id, or \"auto\" for the first one heard; without a credential");
  app.add_option("--lcm-url", options->lcm_url,
                 "LCM's URL: udpm://239.255.76.67:7667?ttl=0, tcpq://HOST:7700, or "
                 "tcpqs://HOST:7700 (encrypted); else the invitation's, or LCM_DEFAULT_URL");
  app.add_option(
         "--auth", options->auth,
         "Messages without a signature: off (nothing is signed), warn (may offer photos and "
         "read) or require (refused); default: require where the URL leaves this host, else "
         "warn")
      ->check(CLI::IsMember({"off", "warn", "require"}));
}

void AddCommonOptions(CLI::App& app, NodeOptions* options) {
  app.add_option("--session", options->session_dir, "Session folder, on its host");
  AddPlaceOptions(app, options);
  app.add_option("--instance", options->instance, "Name of this process, unique in the session");
  app.add_option("--threads", options->threads, "Threads that it may use")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app.add_flag("--verbose", options->verbose, "Log more");
}

Program ServiceProgram(const char* description, NodeOptions* node) {
  Program program;
  program.section = node->service;
  program.description = description;
  program.add_place_options = [node](CLI::App& app) { AddCommonOptions(app, node); };
  return program;
}

}  // namespace skein
