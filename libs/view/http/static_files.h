#pragma once

#include <filesystem>
#include <string>

#include "core/result.h"
#include "http/http.h"

namespace skein {

// The files of a folder: "/" is index.html, and "/phone" is phone.html. If NAME.gz lies beside a
// file, clients that accept gzip get NAME.gz. Nothing outside of the folder is given, by whatever
// path or symbolic link; nor is a file or folder whose name begins with a dot. Any thread.
class StaticFiles {
 public:
  explicit StaticFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

  // An error where the page was never built: a line for the log.
  Status Check() const;

  // If the page was never built, pages are answered with a text for people that says what to do.
  HttpResponse Get(const std::string& path, bool takes_gzip = false) const;

 private:
  const std::filesystem::path folder_;
};

}  // namespace skein
