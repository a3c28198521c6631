#include "http/static_files.h"

#include <algorithm>

namespace skein {
namespace {

namespace fs = std::filesystem;

// False for empty parts, "." and "..", other names that begin with a dot, and backslashes.
bool IsPlainPath(const std::string& path) {
  size_t begin = 1;
  while (begin <= path.size()) {
    const size_t end = std::min(path.find('/', begin), path.size());
    if (end == begin || path[begin] == '.') return false;
    begin = end + 1;
  }
  return path.find('\\') == std::string::npos;
}

bool IsBelow(const fs::path& file, const fs::path& folder) {
  const auto [in_folder, in_file] =
      std::mismatch(folder.begin(), folder.end(), file.begin(), file.end());
  return in_folder == folder.end() && in_file != file.end();
}

constexpr char kIndex[] = "index.html";
constexpr char kNotBuilt[] =
    "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\">"
    "<meta name=\"viewport\" content=\"width=device-width\"><title>Skein</title>"
    "<h1>The page of the live view is not built</h1>"
    "<p>The session runs without it. On the host of the session, in Skein's folder, run "
    "<code>scripts/setup.sh</code>, which gets what the page is made with, build again, and reload "
    "this.</p><p>The data is under <a href=\"/api/session\">/api/</a>.</p></html>\n";

HttpResponse NotBuilt() {
  HttpResponse response;
  response.status = 404;
  response.content_type = "text/html; charset=utf-8";
  response.text = kNotBuilt;
  return response;
}

}  // namespace

Status StaticFiles::Check() const {
  std::error_code error;
  if (fs::is_regular_file(folder_ / kIndex, error)) return Status::Ok();
  return NotFound("there is no page in " + folder_.string() +
                  ": run scripts/setup.sh and build again");
}

HttpResponse StaticFiles::Get(const std::string& path, bool takes_gzip) const {
  const std::string name = path == "/" ? "/index.html" : path == "/phone" ? "/phone.html" : path;
  if (name.empty() || name.front() != '/' || !IsPlainPath(name)) {
    return HttpError(404, "there is no such page");
  }
  const bool is_page = name == "/index.html" || name == "/phone.html";
  if (is_page && !Check().ok()) return NotBuilt();
  std::error_code error;
  const fs::path folder = fs::canonical(folder_, error);
  if (error) return HttpError(404, "there is no such page");
  const fs::path file = fs::canonical(folder / name.substr(1), error);
  if (error || !IsBelow(file, folder) || !fs::is_regular_file(file, error)) {
    return HttpError(404, "there is no such page");
  }
  HttpResponse response;
  response.content_type = ContentTypeOf(file.filename().string());
  response.file = file;
  response.file_root = folder;
  const fs::path packed = file.string() + ".gz";
  response.gzipped = takes_gzip && fs::is_regular_file(fs::symlink_status(packed, error));
  if (response.gzipped) response.file = packed;
  return response;
}

}  // namespace skein
