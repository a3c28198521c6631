#include "config/program_options.h"

#include <CLI/CLI.hpp>
#include <cstdio>

#include "config/finite.h"
#include "config/option_section.h"
#include "config/usage.h"

namespace skein {
namespace {

Status ReadFileInto(const Program& program, const std::string& path, CLI::App* app) {
  if (path.empty()) return Status::Ok();
  const auto file = ReadConfigFile(path);
  if (!file) return file.status();
  const Status status = ApplySection(*file, program.section, app);
  return status.ok() && program.read_more ? program.read_more(*file) : status;
}

Status Check(const Program& program) {
  const Status status = program.check ? program.check() : Status::Ok();
  return status.ok() ? status : InvalidArgument("[" + program.section + "] " + status.error());
}

std::string Text(const Program& program, CLI::App* app, bool with_comments) {
  const std::string text = SectionText(program.section, app, with_comments);
  return program.print_more ? text + program.print_more(with_comments) : text;
}

int Refuse(const Program& program, const std::string& why) {
  std::fprintf(stderr, "skein-%s: %s\n", program.section.c_str(), why.c_str());
  return 2;
}

}  // namespace

std::optional<int> ParseProgramOptions(const Program& program, int argc, char** argv,
                                       std::string* configuration) {
  CLI::App app(program.description);
  std::string path;
  bool print = false;
  app.option_defaults()->configurable(false);
  if (program.add_place_options) program.add_place_options(app);
  app.add_option("--config", path,
                 "TOML file of all services' options; the command line goes first");
  app.add_flag("--print-config", print, "Print this service's section of such a file, and end");
  if (!program.version.empty()) {
    app.set_version_flag("--version", "skein-" + program.section + " " + program.version,
                         "Print version and commit, and end");
  }
  app.option_defaults()->configurable(true);
  program.add_options(app);
  for (CLI::Option* option : app.get_options()) {
    if (option->get_configurable()) option->capture_default_str();  // for --help
  }
  app.footer("Exit codes: 0 stopped by a signal, 1 error, 2 bad usage.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    return Refuse(program, UsageError(app, error) + " (--help tells the options)");
  }
  Status status = ReadFileInto(program, path, &app);
  const std::string not_finite = NotFinite(app);
  if (status.ok() && !not_finite.empty()) {
    status = InvalidArgument("[" + program.section + "] " + not_finite);
  }
  if (status.ok()) status = Check(program);
  if (!status.ok()) return Refuse(program, status.error());
  *configuration = Text(program, &app, false);
  if (!print) return std::nullopt;
  std::fputs(Text(program, &app, true).c_str(), stdout);
  return 0;
}

}  // namespace skein
