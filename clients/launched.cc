#include "clients/launched.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "auth/home_mark.h"
#include "clients/subcommand.h"
#include "core/file_below.h"
#include "core/one_line.h"
#include "transport/lcm_url.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMaxNoteBytes = 4096;
constexpr char kMark[] = "mark ";

struct Note {
  std::vector<std::string> lines;
  bool is_own = false;
};

std::string PurposeOf(const SessionPaths& paths, const fs::path& file) {
  return file.lexically_relative(paths.root).string();
}

Status WriteNote(const SessionPaths& paths, const fs::path& file,
                 const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  const Result<std::string> mark = HomeMarkOf(PurposeOf(paths, file), text);
  if (mark.ok()) text += kMark + *mark + "\n";
  Status status = CreateFoldersBelow(paths.root, file.parent_path());
  if (status.ok()) status = WriteFileBelow(paths.root, file, text.data(), text.size());
  return status.ok() ? mark.status() : status;
}

// Without lines where there is no note.
Note ReadNote(const SessionPaths& paths, const fs::path& file) {
  Note note;
  const Result<Bytes> bytes = ReadFileBelow(paths.root, file, kMaxNoteBytes);
  if (!bytes.ok()) return note;
  std::string text(bytes->begin(), bytes->end()), mark;
  const size_t mark_at = text.rfind(std::string("\n") + kMark);
  if (mark_at != std::string::npos) {
    mark = text.substr(mark_at + sizeof(kMark));
    text.resize(mark_at + 1);
  }
  const Result<std::string> own = HomeMarkOf(PurposeOf(paths, file), text);
  note.is_own = own.ok() && mark == *own + "\n";
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty()) note.lines.push_back(line);
  }
  return note;
}

Status NotOwn(const fs::path& file, const std::string& address, const std::string& instead) {
  return FailedPrecondition(
      file.string() + " leads to " + OneLine(address) +
      ", and was not written by skein launch of this user on this host: " + instead);
}

}  // namespace

Status NoteLaunchedUrl(const SessionPaths& paths, const std::string& url) {
  return WriteNote(paths, paths.LaunchedUrl(), {url});
}

Status NoteBrowserAddresses(const SessionPaths& paths, const std::vector<std::string>& addresses) {
  return WriteNote(paths, paths.BrowserAddresses(), addresses);
}

Result<std::string> LaunchedUrl(const SessionPaths& paths) {
  const Note note = ReadNote(paths, paths.LaunchedUrl());
  if (note.lines.empty()) return std::string();
  const std::string& url = note.lines.front();
  try {
    if (note.is_own || !ParseLcmUrl(url).leaves_host()) return url;
  } catch (const std::invalid_argument& error) {
    return DataLoss(paths.LaunchedUrl().string() + ": " + OneLine(error.what()) +
                    "; launch the session again, or give --lcm-url");
  }
  return NotOwn(paths.LaunchedUrl(), url,
                "launch the session here (one that was sent: launch its `skein clone`), or give "
                "--lcm-url for where it runs");
}

Result<std::vector<std::string>> BrowserAddresses(const SessionPaths& paths) {
  const Note note = ReadNote(paths, paths.BrowserAddresses());
  if (note.lines.empty() || note.is_own) return note.lines;
  return NotOwn(paths.BrowserAddresses(), note.lines.front(),
                "start the session here with `skein launch --web-public HOST`");
}

int RunLaunched(int argc, char** argv) {
  std::string dir, url;
  std::vector<std::string> addresses;
  CLI::App app(
      "Notes in a session folder where the session runs, for commands that are given the folder.\n"
      "`skein launch` does this. A command follows a note to another host only if this user wrote "
      "it "
      "on\n"
      "this host.",
      "skein launched");
  app.add_option("SESSION", dir, "Session folder")->required();
  app.add_option("--lcm-url", url, "LCM's URL");
  app.add_option("--browser-address", addresses,
                 "Address at which browsers are let in; repeat it, https first")
      ->take_all()
      ->allow_extra_args(false);
  if (const auto code = ParseOptions(&app, argc, argv)) return *code;
  const SessionPaths paths{dir};
  Status status = url.empty() ? Status::Ok() : NoteLaunchedUrl(paths, url);
  if (status.ok() && !addresses.empty()) status = NoteBrowserAddresses(paths, addresses);
  if (status.ok()) return kExitOk;
  std::cerr << "skein launched: " << OneLine(status.error()) << std::endl;
  return kExitError;
}

}  // namespace skein
